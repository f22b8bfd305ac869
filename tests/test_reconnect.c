/* The closure search (the best triangulation of a cavity): compared with exhaustive enumeration,
 * and on polyhedra whose triangulations are known. */
#ifndef LINKED
#  define DELAUNAY_IMPLEMENTATION
#endif
#include "../delaunay.h"
#include "check.h"
#include "small_mesh.h"
#include <math.h>

/* Volume over squared lengths: integers below 2^53 for integer points, so the same bits in any
 * order. */
static double compactness(void *user, const double *a, const double *b, const double *c,
                          const double *d)
{
    const double *p[4];
    double u[3][3], det, sum = 0;
    int i, j, k;
    (void)user;
    p[0] = a;
    p[1] = b;
    p[2] = c;
    p[3] = d;
    for (i = 0; i < 3; i++)
        for (k = 0; k < 3; k++) u[i][k] = p[i + 1][k] - a[k];
    det = u[0][0] * (u[1][1] * u[2][2] - u[1][2] * u[2][1]) +
          u[0][1] * (u[1][2] * u[2][0] - u[1][0] * u[2][2]) +
          u[0][2] * (u[1][0] * u[2][1] - u[1][1] * u[2][0]);
    for (i = 0; i < 4; i++)
        for (j = 0; j < i; j++)
            for (k = 0; k < 3; k++) sum += (p[i][k] - p[j][k]) * (p[i][k] - p[j][k]);
    return det / sum;
}

static void compactnesses(void *user, const double *a, const double *b, const double *c, size_t n,
                          const double *apices, double *out)
{
    size_t i;
    for (i = 0; i < n; i++) {
        double p[3];
        p[0] = apices[i];
        p[1] = apices[i + DELAUNAY_WINDOW_VERTICES];
        p[2] = apices[i + 2 * DELAUNAY_WINDOW_VERTICES];
        out[i] = compactness(user, a, b, c, p);
    }
    for (; i < DELAUNAY_WINDOW_VERTICES; i++) out[i] = 1; /* nobody may look there */
}

/* -- enumeration: all sets of tetrahedra that fill the window, by intersection tests and exact
 * volumes */

typedef struct tetrahedron {
    uint32_t v[4];
    double   volume, quality;
    uint64_t fits[2]; /* which others it can stand beside */
} tetrahedron;

#define GOOD 0.3 /* what is less compact is bad */

/* What a bad one weighs. */
static double heaviness(void *user, double quality)
{
    (void)user;
    return 1 + 8 * (GOOD - quality);
}

typedef struct enumeration {
    const delaunay_mesh   *mesh;
    const delaunay_window *window;
    tetrahedron tets[70];
    uint32_t    num_tets, chosen[70], num_chosen, target[3];
    double      volume;
    long        count;
    double      best_quality, bound; /* bound: of the search for fewest bad ones */
    uint32_t    fewest_faces, fewest_edges, fewest_bad;
    uint32_t    max_bad;             /* with no more bad ones, and no heavier: */
    double      max_weight, best_light;
} enumeration;

static const double *point(const enumeration *e, uint32_t local)
{
    return e->mesh->vertices[e->window->vertices[local]].x;
}

static int side(const enumeration *e, uint32_t a, uint32_t b, uint32_t c, uint32_t d)
{
    return delaunay_orient3d(point(e, a), point(e, b), point(e, c), point(e, d));
}

/* Segment ab meets triangle pqr, general position. */
static int crosses(const enumeration *e, uint32_t a, uint32_t b, uint32_t p, uint32_t q, uint32_t r)
{
    if (a == p || a == q || a == r || b == p || b == q || b == r) return 0;
    if (side(e, p, q, r, a) == side(e, p, q, r, b)) return 0;
    return side(e, a, b, p, q) == side(e, a, b, q, r) && side(e, a, b, q, r) == side(e, a, b, r, p);
}

static int edges_cross(const enumeration *e, const uint32_t *s, uint32_t ns, const uint32_t *t,
                       uint32_t nt)
{
    uint32_t i, j, k, l, m;
    for (i = 0; i < ns; i++)
        for (j = 0; j < i; j++)
            for (k = 0; k < nt; k++)
                for (l = 0; l < k; l++)
                    for (m = 0; m < l; m++)
                        if (crosses(e, s[i], s[j], t[k], t[l], t[m])) return 1;
    return 0;
}

static int inside(const enumeration *e, const uint32_t *t, uint32_t p)
{
    return side(e, p, t[1], t[2], t[3]) > 0 && side(e, t[0], p, t[2], t[3]) > 0 &&
           side(e, t[0], t[1], p, t[3]) > 0 && side(e, t[0], t[1], t[2], p) > 0;
}

/* Interiors disjoint, general position. */
static int disjoint(const enumeration *e, const uint32_t *s, const uint32_t *t)
{
    uint32_t i, j, shared = 0, a = 0, b = 0;
    for (i = 0; i < 4; i++)
        for (j = 0; j < 4; j++) shared += s[i] == t[j];
    if (shared == 4) return 0;
    if (shared == 3) {
        for (i = 0; i < 4; i++) {
            for (j = 0; j < 4 && s[i] != t[j]; j++) {}
            if (j == 4) a = i;
            for (j = 0; j < 4 && t[i] != s[j]; j++) {}
            if (j == 4) b = i;
        }
        i = (a + 1) & 3;
        j = (a + 2) & 3;
        return side(e, s[i], s[j], s[(a + 3) & 3], s[a]) !=
               side(e, s[i], s[j], s[(a + 3) & 3], t[b]);
    }
    if (edges_cross(e, s, 4, t, 4) || edges_cross(e, t, 4, s, 4)) return 0;
    for (i = 0; i < 4; i++) {
        for (j = 0; j < 4 && s[i] != t[j]; j++) {}
        if (j == 4 && inside(e, t, s[i])) return 0;
        for (j = 0; j < 4 && t[i] != s[j]; j++) {}
        if (j == 4 && inside(e, s, t[i])) return 0;
    }
    return 1;
}

/* Two that share fewer than three vertices and do not overlap can still meet in a wedge at a shared
 * vertex or edge; the exact total volume excludes that. In the window: the centroid lies in an old
 * tetrahedron. */
static int in_window(const enumeration *e, const uint32_t *t)
{
    uint32_t i, j, k, f[3];
    double c[3];
    for (k = 0; k < 3; k++)
        c[k] = point(e, t[0])[k] + point(e, t[1])[k] + point(e, t[2])[k] + point(e, t[3])[k];
    for (i = 0; i < e->window->num_facets; i++) {
        for (k = 0; k < 3; k++) f[k] = e->window->facets[i][k];
        if (edges_cross(e, t, 4, f, 3) || edges_cross(e, f, 3, t, 4)) return 0;
    }
    for (i = 0; i < e->window->num_tets; i++) {
        double x[4][3];
        const uint32_t *v = e->mesh->tets[e->window->tets[i]].v;
        for (j = 0; j < 4; j++)
            for (k = 0; k < 3; k++) x[j][k] = 4 * e->mesh->vertices[v[j]].x[k];
        if (delaunay_orient3d(c, x[1], x[2], x[3]) >= 0 &&
            delaunay_orient3d(x[0], c, x[2], x[3]) >= 0 &&
            delaunay_orient3d(x[0], x[1], c, x[3]) >= 0 &&
            delaunay_orient3d(x[0], x[1], x[2], c) >= 0)
            return 1;
    }
    return 0;
}

static int has(const uint32_t *t, uint32_t v)
{
    return t[0] == v || t[1] == v || t[2] == v || t[3] == v;
}

static int on_boundary(const enumeration *e, uint32_t a, uint32_t b, uint32_t c)
{
    uint32_t i;
    for (i = 0; i < e->window->num_facets; i++) {
        const uint8_t *f = e->window->facets[i];
        uint32_t m = 1u << f[0] | 1u << f[1] | 1u << f[2],
                 w = 1u << a | 1u << b | (c < 32 ? 1u << c : 0);
        if ((m & w) == w) return 1;
    }
    return 0;
}

/* A set that fills the window: conforming, with all that must be there? Then counts for each
 * objective. */
static void judge(enumeration *e)
{
    const delaunay_window *w = e->window;
    uint32_t i, j, k, l, used = 0, faces = 0, edges = 0, bad = 0;
    double q = 1e300, weight = 0;
    for (i = 0; i < e->num_chosen; i++) {
        const tetrahedron *t = &e->tets[e->chosen[i]];
        for (k = 0; k < 4; k++) used |= 1u << t->v[k];
        if (t->quality < q) q = t->quality;
        bad += t->quality < GOOD;
        if (t->quality < GOOD) weight += heaviness(NULL, t->quality);
        for (k = 0; k < 4; k++) { /* each facet: on the boundary or shared */
            uint32_t a = t->v[k ? 0 : 1], b = t->v[k < 2 ? 2 : 1], c = t->v[k < 3 ? 3 : 2],
                     others = 0;
            for (j = 0; j < e->num_chosen; j++) {
                const uint32_t *v = e->tets[e->chosen[j]].v;
                others += j != i && has(v, a) && has(v, b) && has(v, c);
                if (j > i && has(v, a) && has(v, b) && has(v, c))
                    faces += (uint32_t)delaunay_segment_crosses(e->mesh, e->target[0], e->target[1],
                                                                w->vertices[a], w->vertices[b],
                                                                w->vertices[c], NULL);
            }
            if (!others && !on_boundary(e, a, b, c)) return;
        }
    }
    if (w->interior & ~w->dropped & ~used) return;
    for (i = 0; i < w->num_kept_edges; i++) {
        for (j = 0; j < e->num_chosen; j++)
            if (has(e->tets[e->chosen[j]].v, w->kept_edges[i][0]) &&
                has(e->tets[e->chosen[j]].v, w->kept_edges[i][1]))
                break;
        if (j == e->num_chosen) return;
    }
    for (i = 0; i < w->num_kept_facets; i++) {
        const uint8_t *f = w->kept_facets[i];
        for (j = 0; j < e->num_chosen; j++) {
            const uint32_t *v = e->tets[e->chosen[j]].v;
            if (has(v, f[0]) && has(v, f[1]) && has(v, f[2])) break;
        }
        if (j == e->num_chosen) return;
    }
    for (k = 0; k < w->num_vertices; k++)
        for (l = 0; l < k; l++) {
            if (on_boundary(e, k, l, 99)) continue;
            for (j = 0; j < e->num_chosen; j++)
                if (has(e->tets[e->chosen[j]].v, k) && has(e->tets[e->chosen[j]].v, l)) break;
            if (j < e->num_chosen)
                edges += (uint32_t)delaunay_segment_crosses(e->mesh, w->vertices[k], w->vertices[l],
                                                            e->target[0], e->target[1],
                                                            e->target[2], NULL);
        }
    e->count++;
    if (q > e->best_quality) e->best_quality = q;
    if (q > e->best_light && bad <= e->max_bad && weight <= e->max_weight) e->best_light = q;
    if (faces < e->fewest_faces) e->fewest_faces = faces;
    if (edges < e->fewest_edges) e->fewest_edges = edges;
    if (q > e->bound && bad < e->fewest_bad) e->fewest_bad = bad;
}

static void enumerate(enumeration *e, uint32_t first, const uint64_t *allowed, double volume)
{
    uint32_t i;
    if (volume == e->volume) judge(e);
    if (volume >= e->volume) return;
    for (i = first; i < e->num_tets; i++) {
        uint64_t next[2];
        if (!(allowed[i / 64] >> (i % 64) & 1)) continue;
        next[0] = allowed[0] & e->tets[i].fits[0];
        next[1] = allowed[1] & e->tets[i].fits[1];
        e->chosen[e->num_chosen++] = i;
        enumerate(e, i + 1, next, volume + e->tets[i].volume);
        e->num_chosen--;
    }
}

/* 0 if the points are not in general position. */
static int enumerate_window(enumeration *e)
{
    const delaunay_window *w = e->window;
    uint32_t n = w->num_vertices, i, j, a[4];
    uint64_t all[2];
    e->num_tets = e->num_chosen = 0;
    e->count = 0;
    e->best_quality = e->best_light = 0;
    e->fewest_faces = e->fewest_edges = e->fewest_bad = 1000;
    e->volume = 0;
    for (i = 0; i < w->num_tets; i++) e->volume += small_volume(e->mesh, w->tets[i]);
    for (a[0] = 0; a[0] < n; a[0]++)
        for (a[1] = 0; a[1] < a[0]; a[1]++)
            for (a[2] = 0; a[2] < a[1]; a[2]++)
                for (a[3] = 0; a[3] < a[2]; a[3]++) {
                    tetrahedron *t = &e->tets[e->num_tets];
                    int s = side(e, a[0], a[1], a[2], a[3]);
                    if (s == 0) return 0;
                    if ((w->dropped >> a[0] | w->dropped >> a[1] | w->dropped >> a[2] |
                         w->dropped >> a[3]) &
                        1)
                        continue;
                    memcpy(t->v, a, sizeof a);
                    if (s < 0) {
                        t->v[0] = a[1];
                        t->v[1] = a[0];
                    }
                    if (!in_window(e, t->v)) continue;
                    t->quality = compactness(NULL, point(e, t->v[0]), point(e, t->v[1]),
                                             point(e, t->v[2]), point(e, t->v[3]));
                    t->volume = 0;
                    for (i = 0; i < 1; i++) {
                        double u[3][3];
                        uint32_t k;
                        for (j = 0; j < 3; j++)
                            for (k = 0; k < 3; k++)
                                u[j][k] = point(e, t->v[j + 1])[k] - point(e, t->v[0])[k];
                        t->volume = u[0][0] * (u[1][1] * u[2][2] - u[1][2] * u[2][1]) +
                                    u[0][1] * (u[1][2] * u[2][0] - u[1][0] * u[2][2]) +
                                    u[0][2] * (u[1][0] * u[2][1] - u[1][1] * u[2][0]);
                    }
                    e->num_tets++;
                }
    for (i = 0; i < e->num_tets; i++) {
        e->tets[i].fits[0] = e->tets[i].fits[1] = 0;
        for (j = 0; j < e->num_tets; j++)
            if (i != j && disjoint(e, e->tets[i].v, e->tets[j].v))
                e->tets[i].fits[j / 64] |= (uint64_t)1 << (j % 64);
    }
    all[0] = all[1] = ~(uint64_t)0;
    enumerate(e, 0, all, 0);
    return 1;
}

/* A random window: tetrahedra joined across facets; closed: with all others that have their
 * vertices in it. */
static size_t grow(const delaunay_mesh *m, delaunay_handle *tets, uint32_t max_vertices, int closed)
{
    uint32_t v[40], n = 4, i, k, tries;
    size_t count = 1, j;
    do tets[0] = 1 + (delaunay_handle)small_random(m->num_tets - 1);
    while (delaunay_is_deleted(m, tets[0]));
    memcpy(v, m->tets[tets[0]].v, sizeof m->tets[0].v);
    for (tries = 0; tries < 100 && count < 30; tries++) {
        const delaunay_tet *t = &m->tets[tets[small_random((uint32_t)count)]];
        delaunay_handle h = t->n[small_random(4)];
        uint32_t apex;
        if (!h) continue;
        for (j = 0; j < count && tets[j] != h / 4; j++) {}
        if (j < count) continue;
        apex = m->tets[h / 4].v[h % 4];
        for (i = 0; i < n && v[i] != apex; i++) {}
        if (i == n && n == max_vertices) continue;
        if (i == n) v[n++] = apex;
        tets[count++] = h / 4;
        if (n == max_vertices && !closed && small_random(3) == 0) break;
    }
    if (!closed) return count;
    for (j = 0; j < count; j++)
        for (k = 0; k < 4; k++) {
            delaunay_handle h = m->tets[tets[j]].n[k];
            size_t l;
            for (l = 0; l < count && tets[l] != h / 4; l++) {}
            for (i = 0; h && i < n && v[i] != m->tets[h / 4].v[h % 4]; i++) {}
            if (h && l == count && i < n) tets[count++] = h / 4;
        }
    return count;
}

static int pinched(const delaunay_window *w)
{
    uint8_t uses[32][32];
    uint32_t i, k, a, b;
    memset(uses, 0, sizeof uses);
    for (i = 0; i < w->num_facets; i++)
        for (k = 0; k < 3; k++) {
            a = w->facets[i][k];
            b = w->facets[i][(k + 1) % 3];
            if (++uses[a][b] > 1) return 1;
        }
    return 0;
}

static void search_init(delaunay_search *s, delaunay_objective objective, double bound)
{
    memset(s, 0, sizeof *s);
    s->objective = objective;
    s->bound = bound;
    s->quality = compactness;
    s->max_nodes = 10000000;
}

/* The result of a search has no more bad ones, and no heavier, than it may. */
static int is_light(const enumeration *e, const delaunay_search *s)
{
    uint32_t i, bad = 0;
    double weight = 0;
    for (i = 0; i < s->num_tets; i++) {
        const uint8_t *v = s->tets[i];
        double q = compactness(NULL, point(e, v[0]), point(e, v[1]), point(e, v[2]),
                               point(e, v[3]));
        if (!(q < GOOD)) continue;
        bad++;
        weight += heaviness(NULL, q);
    }
    return bad <= e->max_bad && weight <= e->max_weight;
}

/* Repeats a crossing search until it proves that there is no better; returns the last value. */
static uint32_t fewest(const enumeration *e, delaunay_worker *w, delaunay_objective objective)
{
    delaunay_search s;
    search_init(&s, objective, 1000);
    memcpy(s.target, e->target, sizeof s.target);
    while (delaunay_reconnect(e->mesh, w, e->window, &s)) s.bound = s.value;
    CHECK(s.proven);
    return (uint32_t)s.bound;
}

/* Fewest bad ones among the triangulations above a bound: 1000 if there are none. */
static uint32_t fewest_bad(const enumeration *e, delaunay_worker *w, uint32_t fewer_than)
{
    delaunay_search s;
    int found;
    search_init(&s, DELAUNAY_FEWER_BAD, e->bound);
    s.good = GOOD;
    s.num_bad = fewer_than;
    found = delaunay_reconnect(e->mesh, w, e->window, &s);
    CHECK(s.proven && (!found || s.value > e->bound));
    return found ? s.num_bad : 1000;
}

/* Marks some facets and edges of the tetrahedra. */
static void mark_inside(delaunay_mesh *m, delaunay_worker *w, const delaunay_handle *tets, size_t n)
{
    delaunay_handle h = tets[small_random((uint32_t)n)];
    const uint32_t *v = m->tets[h].v;
    if (small_random(2)) delaunay_mark_facet(m, 4 * h + (delaunay_handle)small_random(4), 1);
    else delaunay_mark_edge(m, w, h, v[0], v[1 + small_random(3)], 1);
    h = tets[small_random((uint32_t)n)];
    if (small_random(2)) delaunay_mark_facet(m, 4 * h + (delaunay_handle)small_random(4), 1);
}

/* Compares the searches for all objectives with an enumeration. nodes: gets what they have gone
 * through, with each heuristic off in turn. */
static void searches_agree(const enumeration *e, delaunay_worker *w, uint64_t nodes[4])
{
    static delaunay_search s;
    uint32_t i;
    for (i = 0; i < 4; i++) {
        search_init(&s, DELAUNAY_BEST_QUALITY, 0);
        s.flags = i ? 1u << (i - 1) : 0;
        CHECK(delaunay_reconnect(e->mesh, w, e->window, &s) == (e->count > 0));
        CHECK(s.proven && s.value == e->best_quality);
        nodes[i] += s.nodes;
        s.qualities = compactnesses;
        CHECK(delaunay_reconnect(e->mesh, w, e->window, &s) == (e->count > 0));
        CHECK(s.proven && s.value == e->best_quality);
    }
    s.flags = 0;
    s.good = GOOD;
    s.num_bad = e->max_bad;
    s.weigh = heaviness;
    s.max_weight = e->max_weight;
    CHECK(delaunay_reconnect(e->mesh, w, e->window, &s) == (e->best_light > 0));
    CHECK(s.proven && s.value == e->best_light);
    CHECK(s.num_tets == 0 || is_light(e, &s));
    s.flags = 0;
    s.bound = e->best_quality;
    CHECK(!delaunay_reconnect(e->mesh, w, e->window, &s) && s.proven);
    search_init(&s, DELAUNAY_ANY, 0);
    CHECK(delaunay_reconnect(e->mesh, w, e->window, &s) == (e->count > 0) && s.proven);
    CHECK(fewest(e, w, DELAUNAY_FEWER_FACES) == e->fewest_faces);
    CHECK(fewest(e, w, DELAUNAY_FEWER_EDGES) == e->fewest_edges);
    CHECK(fewest_bad(e, w, 1000) == e->fewest_bad);
    CHECK(fewest_bad(e, w, e->fewest_bad) == 1000);
    CHECK(fewest_bad(e, w, e->fewest_bad + 1) == e->fewest_bad);
}

static void agrees_with_enumeration(void)
{
    delaunay_mesh m;
    delaunay_worker *w = NULL;
    static enumeration e;
    static delaunay_window window;
    delaunay_handle tets[200];
    long pass, windows = 0, with_interior = 0, with_dropped = 0, with_pinch = 0, with_kept_edge = 0,
               with_kept_facet = 0;
    long several = 0, with_bad = 0, without = 0, light = 0, heavy = 0;
    uint64_t nodes[4] = {0, 0, 0, 0};
    uint32_t i, j;
    CHECK(small_delaunay(&m, &w, NULL, 50));
    for (pass = 0; pass < 6000; pass++) {
        uint32_t size = 5 + small_random(4);
        size_t n = grow(&m, tets, size, (int)small_random(3));
        delaunay_handle t;
        for (t = 1; t < m.num_tets; t++) m.flags[t] = 0;
        if (pass % 3 == 1) mark_inside(&m, w, tets, n);
        if (!delaunay_window_set(&window, &m, tets, n, 8, 1, 1)) continue;
        if (pass % 3 == 2 && window.interior)
            window.dropped = window.interior & (0u - window.interior);
        e.mesh = &m;
        e.window = &window;
        for (i = 0; i < 3; i++)
            do {
                e.target[i] = 1 + small_random(m.num_vertices - 1);
                for (j = 0; j < i && e.target[j] != e.target[i]; j++) {}
            } while (j < i);
        e.bound = 0.02 * (double)(pass % 8);
        e.max_bad = (uint32_t)(pass / 2 % 6);
        e.max_weight = 1 + 2 * (double)(pass / 12 % 6);
        if (!enumerate_window(&e)) continue;
        windows++;
        with_interior += window.interior != 0;
        with_dropped += window.dropped != 0;
        with_pinch += pinched(&window);
        with_kept_edge += window.num_kept_edges > 0;
        with_kept_facet += window.num_kept_facets > 0;
        several += e.count > 1;
        searches_agree(&e, w, nodes);
        light += e.best_light > 0 && e.best_light < e.best_quality;
        heavy += e.best_light == 0 && e.count > 0;
        with_bad += e.fewest_bad > 0 && e.fewest_bad < 1000;
        without += e.fewest_bad == 1000;
    }
    CHECK(nodes[0] < 8 * (uint64_t)windows); /* 7.2 a window when this was written */
    CHECK(2 * nodes[0] < nodes[1] && nodes[0] < nodes[2] && nodes[0] == nodes[3]);
    CHECK(windows > 4000 && with_interior > 30 && with_dropped > 10 && with_pinch > 100 &&
          with_kept_edge > 50);
    CHECK(with_kept_facet > 500 && several > 3000);
    CHECK(with_bad > 500 && without > 200 && light > 20 && heavy > 500);
    delaunay_worker_free(w);
    delaunay_mesh_free(&m);
}

/* Signs do not depend on how far each axis is stretched, and so nothing does that rests on them. */
static void stretching_changes_nothing(void)
{
    static const int power[8][3] = {{0, 0, -60},        {-160, 0, 0},    {150, 150, -150},
                                    {-200, -200, -200}, {190, 190, 190}, {0, -330, 40},
                                    {-30, -500, 0},     {166, -166, 0}};
    delaunay_mesh m;
    delaunay_worker *w = NULL;
    static delaunay_window window;
    static delaunay_search s, plain;
    delaunay_handle tets[200];
    uint32_t v;
    long pass, found = 0;
    int k, i;
    CHECK(small_delaunay(&m, &w, NULL, 100));
    for (pass = 0; pass < 300; pass++) {
        size_t n = grow(&m, tets, 6 + small_random(12), (int)(pass & 1));
        delaunay_objective objective = pass & 2 ? DELAUNAY_FEWER_FACES : DELAUNAY_FEWER_EDGES;
        if (!delaunay_window_set(&window, &m, tets, n, 20, 1, 1)) continue;
        search_init(&plain, objective, 1000);
        plain.max_nodes = 3000;
        for (i = 0; i < 3; i++) plain.target[i] = window.vertices[i];
        s = plain;
        found += delaunay_reconnect(&m, w, &window, &plain);
        for (k = 0; k < 8; k++) {
            for (v = 1; v < m.num_vertices; v++)
                for (i = 0; i < 3; i++) m.vertices[v].x[i] = ldexp(m.vertices[v].x[i], power[k][i]);
            (void)delaunay_reconnect(&m, w, &window, &s);
            for (v = 1; v < m.num_vertices; v++)
                for (i = 0; i < 3; i++)
                    m.vertices[v].x[i] = ldexp(m.vertices[v].x[i], -power[k][i]);
            CHECK(s.nodes == plain.nodes && s.value == plain.value && s.num_tets == plain.num_tets);
            CHECK(memcmp(s.tets, plain.tets, 4 * s.num_tets) == 0);
        }
    }
    CHECK(found > 100);
    delaunay_worker_free(w);
    delaunay_mesh_free(&m);
}

static void improved_windows_commit(void)
{
    delaunay_mesh m;
    delaunay_worker *w = NULL;
    static delaunay_window window;
    static delaunay_search s;
    delaunay_handle tets[200], slots[DELAUNAY_WINDOW_TETS];
    long pass, done[4] = {0, 0, 0, 0};
    CHECK(small_delaunay(&m, &w, NULL, 100));
    for (pass = 0; pass < 400; pass++) {
        size_t n = grow(&m, tets, 6 + small_random(9), pass & 1), i;
        delaunay_objective objective = (delaunay_objective)small_random(4);
        double worst = 1e300;
        if (!delaunay_window_set(&window, &m, tets, n, 16, 1, 1)) continue;
        search_init(&s, objective, 0);
        s.max_nodes = 2000;
        for (i = 0; i < 3; i++) s.target[i] = window.vertices[small_random(window.num_vertices)];
        if (objective == DELAUNAY_BEST_QUALITY) {
            for (i = 0; i < n; i++) {
                const uint32_t *v = m.tets[tets[i]].v;
                double q = compactness(NULL, m.vertices[v[0]].x, m.vertices[v[1]].x,
                                       m.vertices[v[2]].x, m.vertices[v[3]].x);
                if (q < worst) worst = q;
            }
            s.bound = worst;
        } else if (objective != DELAUNAY_ANY) {
            s.bound = delaunay_window_crossings(&m, &window, objective, s.target);
        }
        if (!delaunay_reconnect(&m, w, &window, &s)) continue;
        done[objective]++;
        CHECK(delaunay_window_apply(&m, w, &window, &s, slots) == DELAUNAY_OK);
        if (pass % 8 == 0) CHECK(small_valid(&m) && small_total(&m) == 8e9);
        if (objective == DELAUNAY_BEST_QUALITY) CHECK(s.value > worst);
        else if (objective != DELAUNAY_ANY && s.num_tets <= DELAUNAY_WINDOW_TETS) {
            double before = s.bound;
            if (delaunay_window_set(&window, &m, slots, s.num_tets, 16, 1, 1)) {
                CHECK(delaunay_window_crossings(&m, &window, objective, s.target) ==
                      (uint32_t)s.value);
                CHECK(s.value < before);
            }
        }
    }
    CHECK(small_valid(&m) && small_total(&m) == 8e9);
    CHECK(done[0] > 10 && done[1] > 10 && done[2] > 0 && done[3] > 0);
    delaunay_worker_free(w);
    delaunay_mesh_free(&m);
}

/* Points of a mesh without tetrahedra, and a window by hand around them. */
static delaunay_worker *by_hand(delaunay_mesh *m, delaunay_window *w, const double *xyz, uint32_t n)
{
    uint32_t i;
    CHECK(small_mesh(m, NULL, xyz, n, NULL, 0, 0));
    memset(w, 0, sizeof *w);
    w->num_vertices = n;
    for (i = 0; i < n; i++) w->vertices[i] = i + 1;
    return delaunay_worker_new(&m->memory);
}

static void facet(delaunay_window *w, unsigned a, unsigned b, unsigned c)
{
    uint8_t *f = w->facets[w->num_facets++];
    f[0] = (uint8_t)a;
    f[1] = (uint8_t)b;
    f[2] = (uint8_t)c;
}

static void schoenhardt_has_none_without_a_point(void)
{
    static const double xyz[21] = {10, 0,  0, -5, 9, 0,   -5, -9, 0, 9, 5,
                                   10, -9, 5, 10, 0, -10, 10, 0,  0, 5};
    delaunay_mesh m;
    static delaunay_window w;
    static delaunay_search s;
    delaunay_worker *worker = by_hand(&m, &w, xyz, 7);
    int i, twist;
    for (twist = 0; twist < 2; twist++) {
        w.num_facets = 0;
        facet(&w, 0, 2, 1);
        facet(&w, 3, 4, 5);
        for (i = 0; i < 3; i++) { /* side quadrilaterals i, i+1, 3+i, 3+i+1: one diagonal or the
                                     other, all alike */
            unsigned a = (unsigned)i, b = (unsigned)(i + 1) % 3, c = 3 + b, d = 3 + a;
            if (twist) {
                facet(&w, a, b, d);
                facet(&w, b, c, d);
            } else {
                facet(&w, a, b, c);
                facet(&w, a, c, d);
            }
        }
        w.num_vertices = 6;
        w.interior = 0;
        search_init(&s, DELAUNAY_ANY, 0);
        CHECK(delaunay_reconnect(&m, worker, &w, &s) == twist);
        CHECK(s.proven);
        w.num_vertices = 7;
        w.interior = 1u << 6;
        search_init(&s, DELAUNAY_ANY, 0);
        CHECK(delaunay_reconnect(&m, worker, &w, &s) == 1);
        CHECK(twist == 1 || s.num_tets == 8);
    }
    delaunay_worker_free(worker);
    delaunay_mesh_free(&m);
}

/* A boundary that has a triangle twice bounds nothing; the worker is good for the next search. */
static void boundaries_with_a_triangle_twice_have_none(void)
{
    static const double xyz[12] = {0, 0, 0, 2, 0, 0, 0, 2, 0, 0, 0, 2};
    delaunay_mesh m;
    static delaunay_window w;
    static delaunay_search s;
    delaunay_worker *worker = by_hand(&m, &w, xyz, 4);
    int twice;
    for (twice = 3; twice-- > 0;) {
        w.num_vertices = 4;
        w.num_facets = 0;
        facet(&w, 0, 2, 1);
        facet(&w, 0, 1, 3);
        facet(&w, 1, 2, 3);
        facet(&w, 0, 3, 2);
        if (twice == 2) facet(&w, 3, 0, 1);
        if (twice == 1) facet(&w, 3, 2, 0), facet(&w, 2, 1, 0);
        search_init(&s, DELAUNAY_ANY, 0);
        CHECK(delaunay_reconnect(&m, worker, &w, &s) == (twice == 0));
        CHECK(s.num_tets == (twice == 0));
    }
    delaunay_worker_free(worker);
    delaunay_mesh_free(&m);
}

static void octahedron_takes_the_best_diagonal(void)
{
    static const double xyz[18] = {-20, 0, 0, 20, 0, 0, 0, -16, 0, 0, 16, 0, 0, 0, -12, 0, 0, 12};
    delaunay_mesh m;
    static delaunay_window w;
    static delaunay_search s;
    delaunay_worker *worker = by_hand(&m, &w, xyz, 6);
    unsigned i;
    for (i = 0; i < 8; i++) {
        unsigned a = i & 1, b = 2 + (i >> 1 & 1), c = 4 + (i >> 2);
        if ((i ^ i >> 1 ^ i >> 2) & 1) facet(&w, a, b, c);
        else facet(&w, a, c, b);
    }
    search_init(&s, DELAUNAY_BEST_QUALITY, 0);
    CHECK(delaunay_reconnect(&m, worker, &w, &s) == 1 && s.proven && s.num_tets == 4);
    for (i = 0; i < s.num_tets; i++) {
        uint32_t mask =
            1u << s.tets[i][0] | 1u << s.tets[i][1] | 1u << s.tets[i][2] | 1u << s.tets[i][3];
        CHECK((mask & 0x30) == 0x30); /* the shortest one */
    }
    s.bound = s.value;
    CHECK(delaunay_reconnect(&m, worker, &w, &s) == 0 && s.proven);
    w.num_kept_edges = 1; /* the longest one must stay */
    w.kept_edges[0][0] = 0;
    w.kept_edges[0][1] = 1;
    search_init(&s, DELAUNAY_BEST_QUALITY, 0);
    CHECK(delaunay_reconnect(&m, worker, &w, &s) == 1 && s.proven && s.num_tets == 4);
    for (i = 0; i < s.num_tets; i++) {
        uint32_t mask =
            1u << s.tets[i][0] | 1u << s.tets[i][1] | 1u << s.tets[i][2] | 1u << s.tets[i][3];
        CHECK((mask & 3) == 3);
    }
    w.num_kept_edges = 2; /* and another that crosses it: impossible */
    w.kept_edges[1][0] = 2;
    w.kept_edges[1][1] = 3;
    CHECK(delaunay_reconnect(&m, worker, &w, &s) == 0 && s.proven);
    w.num_kept_edges = 0;
    w.num_kept_facets = 1;
    w.kept_facets[0][0] = 2;
    w.kept_facets[0][1] = 3;
    w.kept_facets[0][2] = 0;
    search_init(&s, DELAUNAY_ANY, 0);
    CHECK(delaunay_reconnect(&m, worker, &w, &s) == 1 && s.num_tets == 4);
    for (i = 0; i < s.num_tets; i++) {
        uint32_t mask =
            1u << s.tets[i][0] | 1u << s.tets[i][1] | 1u << s.tets[i][2] | 1u << s.tets[i][3];
        CHECK((mask & 12) == 12);
    }
    search_init(&s, DELAUNAY_ANY, 0);
    s.max_nodes = 2;
    CHECK(delaunay_reconnect(&m, worker, &w, &s) == 0 && !s.proven && s.nodes == 2);
    delaunay_worker_free(worker);
    delaunay_mesh_free(&m);
}

/* A cube whose face diagonals make a tetrahedron has five tetrahedra; one cut along a main diagonal
 * six. All points are on one sphere, and four on each face. */
static void cubes_have_five_or_six(void)
{
    static const double xyz[24] = {0, 0, 0, 2, 0, 0, 0, 2, 0, 2, 2, 0,
                                   0, 0, 2, 2, 0, 2, 0, 2, 2, 2, 2, 2};
    static const uint32_t five[20] = {0, 1, 2, 4, 3, 1, 2, 7, 5, 1, 4, 7, 6, 2, 4, 7, 1, 2, 4, 7};
    static const uint32_t six[24] = {0, 1, 3, 7, 0, 1, 5, 7, 0, 2, 3, 7,
                                     0, 2, 6, 7, 0, 4, 5, 7, 0, 4, 6, 7};
    delaunay_mesh m;
    static delaunay_window w;
    static delaunay_search s;
    delaunay_worker *worker;
    delaunay_handle tets[6] = {1, 2, 3, 4, 5, 6};
    uint32_t pass;
    for (pass = 5; pass <= 6; pass++) {
        CHECK(small_mesh(&m, NULL, xyz, 8, pass == 5 ? five : six, pass, 1));
        worker = delaunay_worker_new(&m.memory);
        CHECK(!delaunay_window_set(&w, &m, tets, pass, 7, 1, 1));
        CHECK(delaunay_window_set(&w, &m, tets, pass, 8, 1, 1) && w.num_facets == 12 &&
              w.interior == 0);
        search_init(&s, DELAUNAY_BEST_QUALITY, 0);
        CHECK(delaunay_reconnect(&m, worker, &w, &s) == 1 && s.proven && s.num_tets == pass);
        CHECK(delaunay_window_apply(&m, worker, &w, &s, NULL) == DELAUNAY_OK);
        CHECK(small_valid(&m) && small_total(&m) == 48);
        s.bound = s.value;
        CHECK(delaunay_reconnect(&m, worker, &w, &s) == 0 && s.proven);
        tets[0] = pass + 1;
        CHECK(!delaunay_window_set(&w, &m, tets, pass, 8, 1, 1)); /* a ghost */
        tets[0] = 1;
        delaunay_worker_free(worker);
        delaunay_mesh_free(&m);
    }
}

/* A window whose last step of growth is undone and redone gives the same bits as with a fresh
 * worker. */
static void tables_are_reused_safely(void)
{
    delaunay_mesh m;
    delaunay_worker *w = NULL, *fresh;
    static delaunay_window window;
    static delaunay_search s, r;
    delaunay_handle tets[200];
    long pass;
    CHECK(small_delaunay(&m, &w, NULL, 60));
    for (pass = 0; pass < 150; pass++) {
        size_t n = grow(&m, tets, pass % 5 ? 12 : 32, pass & 1), k;
        for (k = 1; k <= n; k++) {
            size_t count = small_random(4) ? k : 1 + small_random((uint32_t)n);
            if (!delaunay_window_set(&window, &m, tets, count, 32, 0, 0)) continue;
            if (small_random(10) == 0) { /* a vertex moves */
                double *x = m.vertices[window.vertices[small_random(window.num_vertices)]].x;
                x[small_random(3)] += 0.25;
            }
            if (k % 4) continue;
            search_init(&s, DELAUNAY_BEST_QUALITY, 0);
            s.max_nodes = pass % 5 ? 100 : 20000; /* fills the memory of dead ends */
            r = s;
            fresh = delaunay_worker_new(&m.memory);
            CHECK(delaunay_reconnect(&m, w, &window, &s) ==
                  delaunay_reconnect(&m, fresh, &window, &r));
            CHECK(s.value == r.value && s.nodes == r.nodes && s.proven == r.proven &&
                  s.num_tets == r.num_tets && !memcmp(s.tets, r.tets, 4 * (size_t)s.num_tets));
            delaunay_worker_free(fresh);
        }
    }
    delaunay_worker_free(w);
    delaunay_mesh_free(&m);
}

int main(void)
{
    agrees_with_enumeration();
    stretching_changes_nothing();
    improved_windows_commit();
    schoenhardt_has_none_without_a_point();
    boundaries_with_a_triangle_twice_have_none();
    octahedron_takes_the_best_diagonal();
    cubes_have_five_or_six();
    tables_are_reused_safely();
    return check_report();
}
