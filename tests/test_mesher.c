/* test_mesher.c - from surface to mesh, end to end, on surfaces made by the program. Each mesh is
 * judged from its arrays alone: tetrahedra are positive, at most two share a facet, every input
 * triangle is a facet, every facet between two regions or at the border is an input triangle, input
 * vertices are the same bit for bit, volumes are right. */
#ifndef LINKED
#  define MESHER_IMPLEMENTATION
#endif
#include "mesher.h"
#include "check.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static uint64_t seed_state = 88172645463325252u;
static uint32_t random_below(uint32_t n)
{
    seed_state ^= seed_state << 13;
    seed_state ^= seed_state >> 7;
    seed_state ^= seed_state << 17;
    return (uint32_t)((seed_state >> 20) % n);
}

/* -- Models. */

enum { MOST_VERTICES = 6000, MOST_TRIANGLES = 12000, MOST_LINES = 64 };
typedef struct model {
    double   xyz[3 * MOST_VERTICES];
    uint32_t triangles[3 * MOST_TRIANGLES], lines[2 * MOST_LINES];
    size_t   nv, nt, nl;
} model;
static model shape; /* the model at hand */

static void clear(void) { shape.nv = shape.nt = shape.nl = 0; }

static uint32_t add_point(double x, double y, double z)
{
    double *p = shape.xyz + 3 * shape.nv;
    p[0] = x;
    p[1] = y;
    p[2] = z;
    return (uint32_t)shape.nv++;
}

static uint32_t find_point(double x, double y, double z)
{
    uint32_t v;
    for (v = 0; v < shape.nv; v++)
        if (shape.xyz[3 * v] == x && shape.xyz[3 * v + 1] == y && shape.xyz[3 * v + 2] == z)
            return v;
    return add_point(x, y, z);
}

static void add_triangle(uint32_t a, uint32_t b, uint32_t c)
{
    uint32_t *t = shape.triangles + 3 * shape.nt++;
    t[0] = a;
    t[1] = b;
    t[2] = c;
}

static void add_quad(uint32_t a, uint32_t b, uint32_t c, uint32_t d, int diagonal)
{
    if (diagonal) {
        add_triangle(a, b, c);
        add_triangle(a, c, d);
    } else {
        add_triangle(a, b, d);
        add_triangle(b, c, d);
    }
}

static void add_line(uint32_t a, uint32_t b)
{
    shape.lines[2 * shape.nl] = a;
    shape.lines[2 * shape.nl++ + 1] = b;
}

static void add_box(double x, double y, double z, double size)
{
    static const int faces[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                    {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    uint32_t v[8];
    int i;
    for (i = 0; i < 8; i++)
        v[i] = add_point(x + (i & 1 ? size : 0), y + (i & 2 ? size : 0), z + (i & 4 ? size : 0));
    for (i = 0; i < 6; i++)
        add_quad(v[faces[i][0]], v[faces[i][1]], v[faces[i][2]], v[faces[i][3]],
                 (int)random_below(2));
}

static void add_sphere(double x, double y, double z, double r, int rings, int spokes)
{
    int i, j;
    uint32_t south = add_point(x, y, z - r), first = (uint32_t)shape.nv, north;
    for (i = 1; i < rings; i++)
        for (j = 0; j < spokes; j++) {
            double a = 3.141592653589793 * i / rings, b = 6.283185307179586 * j / spokes;
            add_point(x + r * sin(a) * cos(b), y + r * sin(a) * sin(b), z - r * cos(a));
        }
    north = add_point(x, y, z + r);
    for (j = 0; j < spokes; j++) {
        uint32_t a = first + (uint32_t)j, b = first + (uint32_t)((j + 1) % spokes);
        add_triangle(south, b, a);
        for (i = 0; i + 2 < rings; i++, a += (uint32_t)spokes, b += (uint32_t)spokes)
            add_quad(a, b, b + (uint32_t)spokes, a + (uint32_t)spokes, (int)random_below(2));
        add_triangle(a, b, north);
    }
}

static void add_torus(double x0, double y0, double z0, uint32_t n, uint32_t k)
{
    uint32_t i, j, base = (uint32_t)shape.nv;
    for (i = 0; i < n; i++)
        for (j = 0; j < k; j++) {
            double u = 6.283185307179586 * i / n, v = 6.283185307179586 * j / k,
                   r = 1 + 0.4 * cos(v);
            add_point(x0 + r * cos(u), y0 + r * sin(u), z0 + 0.4 * sin(v));
        }
    for (i = 0; i < n; i++)
        for (j = 0; j < k; j++)
            add_quad(base + i * k + j, base + (i + 1) % n * k + j,
                     base + (i + 1) % n * k + (j + 1) % k, base + i * k + (j + 1) % k,
                     (int)random_below(2));
}

/* A prism with its upper side turned: no triangulation without a new point. */
static void add_prism(int n, double turn)
{
    int i;
    uint32_t base = (uint32_t)shape.nv;
    for (i = 0; i < 2 * n; i++) {
        double a = 6.283185307179586 * (i % n) / n + (i < n ? 0 : turn);
        add_point(cos(a), sin(a), i < n ? 0 : 1);
    }
    for (i = 0; i < n; i++) {
        uint32_t a = base + (uint32_t)i, b = base + (uint32_t)((i + 1) % n);
        add_triangle(a, b, b + (uint32_t)n); /* the reflex diagonal */
        add_triangle(a, b + (uint32_t)n, a + (uint32_t)n);
    }
    for (i = 1; i + 1 < n; i++) {
        add_triangle(base, base + (uint32_t)i + 1, base + (uint32_t)i);
        add_triangle(base + (uint32_t)n, base + (uint32_t)(n + i), base + (uint32_t)(n + i) + 1);
    }
}

/* Voxels with materials; all faces between different ones, diagonals at random, each face once.
 * Returns the number of bounded cells. */
enum { SIDE = 7 };
static int voxel[SIDE][SIDE][SIDE]; /* [z][y][x]; the outermost layer is 0 */

static int count_voxel_cells(void)
{
    static int seen[SIDE * SIDE * SIDE], queue[SIDE * SIDE * SIDE];
    const int *flat = &voxel[0][0][0];
    int v, w, i, head, tail, cells = 0;
    memset(seen, 0, sizeof seen);
    for (v = 0; v < SIDE * SIDE * SIDE; v++) {
        if (seen[v]) continue;
        cells++;
        seen[v] = 1;
        head = tail = 0;
        queue[tail++] = v;
        while (head < tail) {
            int c = queue[head++], x = c % SIDE, y = c / SIDE % SIDE, z = c / SIDE / SIDE;
            for (i = 0; i < 6; i++) {
                int nx = x + (i == 0) - (i == 1), ny = y + (i == 2) - (i == 3),
                    nz = z + (i == 4) - (i == 5);
                if (nx < 0 || ny < 0 || nz < 0 || nx >= SIDE || ny >= SIDE || nz >= SIDE) continue;
                w = (nz * SIDE + ny) * SIDE + nx;
                if (seen[w] || flat[w] != flat[c]) continue;
                seen[w] = 1;
                queue[tail++] = w;
            }
        }
    }
    return cells - 1;
}

static int voxel_surface(void)
{
    int x, y, z, axis, i;
    for (z = 0; z < SIDE; z++)
        for (y = 0; y < SIDE; y++)
            for (x = 0; x < SIDE; x++)
                for (axis = 0; axis < 3; axis++) {
                    int n[3], k = (axis + 1) % 3, l = (axis + 2) % 3;
                    uint32_t v[4];
                    n[0] = x + (axis == 0);
                    n[1] = y + (axis == 1);
                    n[2] = z + (axis == 2);
                    if (n[axis] >= SIDE || voxel[z][y][x] == voxel[n[2]][n[1]][n[0]]) continue;
                    for (i = 0; i < 4; i++) {
                        int p[3];
                        memcpy(p, n, sizeof p);
                        p[k] += i == 1 || i == 2;
                        p[l] += i >= 2;
                        v[i] = find_point(p[0], p[1], p[2]);
                    }
                    if (voxel[z][y][x] > voxel[n[2]][n[1]][n[0]])
                        add_quad(v[0], v[1], v[2], v[3], (int)random_below(2));
                    else add_quad(v[3], v[2], v[1], v[0], (int)random_below(2));
                }
    return count_voxel_cells();
}

static void random_voxels(int materials)
{
    int x, y, z;
    memset(voxel, 0, sizeof voxel);
    for (z = 1; z < SIDE - 1; z++)
        for (y = 1; y < SIDE - 1; y++)
            for (x = 1; x < SIDE - 1; x++) voxel[z][y][x] = (int)random_below((uint32_t)materials);
}

static mesher_surface surface_of(const model *m)
{
    mesher_surface s;
    memset(&s, 0, sizeof s);
    s.xyz = m->xyz;
    s.num_vertices = m->nv;
    s.triangles = m->triangles;
    s.num_triangles = m->nt;
    s.edges = m->lines;
    s.num_edges = m->nl;
    return s;
}

/* -- The judge. */

typedef struct half { uint32_t v[3]; uint32_t region, turn; } half;
static int compare_halves(const void *p, const void *q)
{
    const half *a = (const half *)p, *b = (const half *)q;
    int i;
    for (i = 0; i < 3; i++)
        if (a->v[i] != b->v[i]) return a->v[i] < b->v[i] ? -1 : 1;
    return a->turn < b->turn ? -1 : a->turn > b->turn;
}
static int same_half(const half *a, const half *b) { return memcmp(a->v, b->v, sizeof a->v) == 0; }

static half make_half(uint32_t a, uint32_t b, uint32_t c, uint32_t region)
{
    half h;
    uint32_t s;
    h.v[0] = a; h.v[1] = b; h.v[2] = c;
    h.region = region;
    h.turn = 0;
    if (h.v[0] > h.v[1]) { s = h.v[0]; h.v[0] = h.v[1]; h.v[1] = s; h.turn ^= 1; }
    if (h.v[1] > h.v[2]) { s = h.v[1]; h.v[1] = h.v[2]; h.v[2] = s; h.turn ^= 1; }
    if (h.v[0] > h.v[1]) { s = h.v[0]; h.v[0] = h.v[1]; h.v[1] = s; h.turn ^= 1; }
    return h;
}

/* First vertex with the same coordinates. */
static uint32_t *weld(const mesher_surface *s)
{
    uint32_t *first = (uint32_t *)malloc((s->num_vertices + 1) * sizeof *first), v, w;
    for (v = 0; v < s->num_vertices; v++) {
        const double *x = s->xyz + 3 * v;
        for (w = 0; w < v; w++)
            if (s->xyz[3 * w] == x[0] && s->xyz[3 * w + 1] == x[1] && s->xyz[3 * w + 2] == x[2])
                break;
        first[v] = w;
    }
    return first;
}

static double six_volumes(const mesher_output *out, uint64_t t)
{
    const uint32_t *v = out->tets + 4 * t;
    const double *a = out->xyz + 3 * v[0], *b = out->xyz + 3 * v[1], *c = out->xyz + 3 * v[2],
                 *d = out->xyz + 3 * v[3];
    double e[3], f[3], g[3];
    int i;
    for (i = 0; i < 3; i++) {
        e[i] = b[i] - a[i];
        f[i] = c[i] - a[i];
        g[i] = d[i] - a[i];
    }
    return e[0] * (f[1] * g[2] - f[2] * g[1]) + e[1] * (f[2] * g[0] - f[0] * g[2]) +
           e[2] * (f[0] * g[1] - f[1] * g[0]);
}

/* The triangles and lines of the output, given the sorted facets of its tetrahedra; used of the
 * surface's triangles, sorted, have three vertices. */
static void judge_surface(const mesher_surface *s, const mesher_output *out, const uint32_t *first,
                          const half *mesh, size_t n, const half *surface, size_t used)
{
    size_t i, k, distinct = 0;
    int bad = 0, side;
    for (i = 0; i < used; i++) distinct += i == 0 || !same_half(surface + i, surface + i - 1);
    CHECK(out->num_triangles == distinct && out->num_edges == s->num_edges);
    for (k = 0; k < out->num_triangles; k++) {
        const uint32_t *v = out->triangles + 3 * k, source = out->triangle_source[k];
        for (i = 0; i < 3; i++) bad += v[i] != first[s->triangles[3 * source + i]];
        bad += out->triangle_tags[k] != (s->triangle_tags ? s->triangle_tags[source] : 1);
        for (side = 0; side < 2; side++) { /* facets turn outwards: the one behind as v */
            half key = make_half(v[0], v[1], v[2], 0), *found;
            key.turn ^= (uint32_t)side;
            found = (half *)bsearch(&key, mesh, n, sizeof key, compare_halves);
            bad += out->triangle_regions[2 * k + (size_t)side] != (found ? found->region : 0);
        }
    }
    for (k = 0; k < 2 * out->num_edges; k++) bad += out->edges[k] != first[s->edges[k]];
    for (k = 0; k < out->num_edges; k++) bad += out->edge_tags[k] != 1;
    CHECK(bad == 0);
}

/* How many triangles, of the first `used`, and lines of a surface the sorted facets of the
 * tetrahedra, n in all, do not have. */
static int num_lost(const mesher_surface *s, const uint32_t *first, half *mesh, size_t n,
                    const half *surface, size_t used)
{
    size_t i, j;
    int lost = 0;
    for (i = 0; i < n; i++) mesh[i].turn = 0;
    for (i = 0; i < used; i++)
        lost += !bsearch(surface + i, mesh, n, sizeof *mesh, compare_halves);
    for (i = 0; i < s->num_edges; i++) {
        uint32_t a = first[s->edges[2 * i]], b = first[s->edges[2 * i + 1]];
        int there = 0;
        for (j = 0; j < n && !there; j++) {
            const uint32_t *v = mesh[j].v;
            there = (v[0] == a || v[1] == a || v[2] == a) && (v[0] == b || v[1] == b || v[2] == b);
        }
        lost += !there;
    }
    return lost;
}

/* Everything that can be said of the arrays; all: every triangle must be a facet, every line an
 * edge. The volume. */
static double judge(const mesher_surface *s, const mesher_output *out, uint32_t regions, int all)
{
    uint32_t *first = weld(s), largest = 0;
    half *mesh = (half *)malloc((size_t)(4 * out->num_tets + 1) * sizeof *mesh);
    half *surface = (half *)malloc((s->num_triangles + 1) * sizeof *surface);
    size_t n = 0, i, j, used;
    int bad = 0;
    double volume = 0;
    CHECK(out->num_vertices >= s->num_vertices);
    CHECK(memcmp(out->xyz, s->xyz, 3 * s->num_vertices * sizeof(double)) == 0);
    for (i = 0; i < out->num_tets; i++) {
        const uint32_t *v = out->tets + 4 * i;
        for (j = 0; j < 4; j++) {
            const uint8_t *o = delaunay_facet_order((int)j);
            if (v[j] >= out->num_vertices || (v[j] < s->num_vertices && first[v[j]] != v[j])) bad++;
            mesh[n++] = make_half(v[o[0]], v[o[1]], v[o[2]], out->regions[i]);
        }
        if (delaunay_orient3d(out->xyz + 3 * v[0], out->xyz + 3 * v[1], out->xyz + 3 * v[2],
                              out->xyz + 3 * v[3]) <= 0)
            bad++;
        if (out->regions[i] == 0) bad++;
        if (out->regions[i] > largest) largest = out->regions[i];
        volume += six_volumes(out, i) / 6;
    }
    CHECK(bad == 0);
    CHECK(largest == regions);
    for (i = j = 0; i < s->num_triangles; i++) {
        const uint32_t *t = s->triangles + 3 * i;
        surface[j] = make_half(first[t[0]], first[t[1]], first[t[2]], 0);
        surface[j].turn = 0;
        j += surface[j].v[0] != surface[j].v[1] && surface[j].v[1] != surface[j].v[2];
    }
    used = j;
    qsort(mesh, n, sizeof *mesh, compare_halves);
    qsort(surface, used, sizeof *surface, compare_halves);
    for (i = 0; i < n; i = j) {
        /* facets: one or two sides, opposite; borders are triangles of the surface */
        for (j = i + 1; j < n && same_half(mesh + i, mesh + j); j++) {}
        if (j > i + 2 || (j == i + 2 && mesh[i].turn == mesh[i + 1].turn)) bad++;
        if (j == i + 1 || mesh[i].region != mesh[i + 1].region) {
            half key = mesh[i];
            key.turn = 0;
            if (!bsearch(&key, surface, used, sizeof key, compare_halves)) bad++;
        }
    }
    CHECK(bad == 0);
    judge_surface(s, out, first, mesh, n, surface, used);
    if (all) bad += num_lost(s, first, mesh, n, surface, used);
    CHECK(bad == 0);
    free(surface);
    free(mesh);
    free(first);
    return volume;
}

static mesher_report report;
static mesher_finding findings[256];

static void prepare(void)
{
    memset(&report, 0, sizeof report);
    report.findings = findings;
    report.cap_findings = 256;
}

/* Meshes the model, judges it, returns the volume; -1 on failure. */
static double mesh_and_judge(const mesher_options *options, uint32_t regions, int all)
{
    mesher_surface s = surface_of(&shape);
    mesher_domain domain;
    mesher_output out;
    mesher_result result;
    double volume = -1;
    int32_t *tags = (int32_t *)malloc((s.num_triangles + 1) * sizeof *tags);
    size_t i;
    for (i = 0; i < s.num_triangles; i++) tags[i] = 100 - 7 * (int32_t)i;
    s.triangle_tags = tags;
    prepare();
    result = mesher_mesh(&domain, &s, options, &report);
    CHECK(result == MESHER_OK || (result > 0 && !options->no_refine));
    if (result < 0) {
        printf("    %s: %s\n", mesher_result_string(result), report.message);
        free(tags);
        return volume;
    }
    CHECK(report.message[0] == 0 && report.num_regions == regions && report.peak_bytes > 0);
    CHECK(delaunay_validate(&domain.mesh, DELAUNAY_VALIDATE_GEOMETRY, NULL) == DELAUNAY_OK);
    result = mesher_export(&domain, &out);
    CHECK(result == MESHER_OK);
    if (result == MESHER_OK) {
        CHECK(out.num_tets == report.num_tets && out.num_vertices == report.num_vertices);
        volume = judge(&s, &out, regions, all);
        mesher_domain_free(&domain); /* the output does not need it */
        mesher_output_free(&domain, &out);
        CHECK(out.xyz == NULL && out.edge_tags == NULL);
    }
    mesher_domain_free(&domain);
    free(tags);
    return volume;
}

static mesher_options recover_only(void)
{
    mesher_options o;
    memset(&o, 0, sizeof o);
    o.no_refine = 1;
    return o;
}

static int near(double a, double b) { return fabs(a - b) <= 1e-9 * (fabs(b) + 1e-300); }

/* -- Valid surfaces. */

static void cubes(void)
{
    mesher_options o = recover_only();
    clear();
    add_box(0, 0, 0, 1);
    CHECK(near(mesh_and_judge(&o, 1, 1), 1));
    CHECK(report.num_vertices == 8 && report.surface_steiner == 0);
    add_box(0.25, 0.25, 0.25, 0.5); /* nested */
    CHECK(near(mesh_and_judge(&o, 2, 1), 1));
    CHECK(report.counts[MESHER_NOTE_SHELL_FILLED] == 1);
    o.regions = MESHER_REGIONS_PARITY;
    CHECK(near(mesh_and_judge(&o, 1, 1), 0.875));
    CHECK(report.counts[MESHER_NOTE_SHELL_FILLED] == 0);
    o.regions = MESHER_REGIONS_WINDING;
    CHECK(near(mesh_and_judge(&o, 2, 1), 1));
    add_box(0.375, 0.375, 0.375, 0.25); /* and once more */
    o.regions = MESHER_REGIONS_PARITY;
    CHECK(near(mesh_and_judge(&o, 2, 1), 0.875 + 0.015625));
    clear();
    add_box(0, 0, 0, 1);
    add_box(2, 0, 0, 1); /* apart */
    CHECK(near(mesh_and_judge(&o, 2, 1), 2));
}

/* Two cubes that share a face, an edge, a vertex; a cube within a cube on its floor: as voxels. */
static void touching_cubes(void)
{
    mesher_options o = recover_only();
    int i;
    for (i = 0; i < 4; i++) {
        memset(voxel, 0, sizeof voxel);
        voxel[1][1][1] = 1;
        voxel[1 + (i == 2)][1 + (i > 0)][2] = 2;
        if (i == 3) {
            int x, y, z;
            for (z = 1; z < 4; z++)
                for (y = 1; y < 4; y++)
                    for (x = 1; x < 4; x++) voxel[z][y][x] = 1;
            voxel[1][2][2] = 2;
        }
        clear();
        CHECK(voxel_surface() == 2);
        CHECK(near(mesh_and_judge(&o, 2, 1), i == 3 ? 27 : 2));
    }
}

static void voxel_materials(void)
{
    mesher_options o = recover_only();
    int i;
    for (i = 0; i < 6; i++) {
        const int *flat = &voxel[0][0][0];
        int cells, v, solid = 0;
        random_voxels(2 + i % 3);
        clear();
        cells = voxel_surface();
        for (v = 0; v < SIDE * SIDE * SIDE; v++) solid += flat[v] != 0;
        CHECK(mesh_and_judge(&o, (uint32_t)cells, 1) >=
              solid - 1e-6); /* bounded voids are filled */
    }
}

static void round_ones(void)
{
    mesher_options o = recover_only();
    clear();
    add_torus(0, 0, 0, 24, 12);
    CHECK(mesh_and_judge(&o, 1, 1) > 2.5);
    add_torus(1, 0, 3, 16, 8);
    CHECK(mesh_and_judge(&o, 2, 1) > 5);
    clear();
    add_sphere(0, 0, 0, 1, 10, 15);
    CHECK(mesh_and_judge(&o, 1, 1) > 3.5);
    add_sphere(0, 0, 0, 0.99, 10, 15); /* a thin skin, other diagonals */
    CHECK(mesh_and_judge(&o, 2, 1) > 3.5);
    o.regions = MESHER_REGIONS_PARITY;
    CHECK(mesh_and_judge(&o, 1, 1) < 0.2);
}

static void prisms_need_points(void)
{
    mesher_options o = recover_only();
    int n;
    for (n = 3; n <= 7; n++) {
        clear();
        add_prism(n, 0.5);
        CHECK(mesh_and_judge(&o, 1, 1) > 0.5);
        CHECK(report.interior_steiner >= 1 && report.surface_steiner == 0);
        CHECK(report.num_vertices == 2 * (uint64_t)n + report.interior_steiner);
    }
}

/* Points in a void do not count. */
static void prisms_in_a_box(void)
{
    mesher_options o = recover_only();
    uint64_t kept;
    clear();
    add_box(-3, -3, -3, 6);
    add_prism(5, 0.5);
    CHECK(mesh_and_judge(&o, 2, 1) > 0.5);
    CHECK(report.interior_steiner >= 1);
    CHECK(report.num_vertices == 18 + report.interior_steiner);
    kept = report.interior_steiner;
    o.regions = MESHER_REGIONS_PARITY;
    CHECK(mesh_and_judge(&o, 1, 1) > 0.5);
    CHECK(report.interior_steiner < kept);
    CHECK(report.num_vertices == 18 + report.interior_steiner);
}

/* Points that the surface itself names: they are vertices of triangles, or in nothing; no note. */
static void leave_out(uint32_t point)
{
    mesher_options o = recover_only();
    mesher_surface s = surface_of(&shape);
    mesher_domain domain;
    mesher_output out;
    uint8_t left_out[100] = {0};
    uint64_t i;
    int used = 0;
    left_out[point] = left_out[0] = 1; /* vertex 0 is in triangles, and stays */
    s.left_out = left_out;
    prepare();
    CHECK(mesher_mesh(&domain, &s, &o, &report) == MESHER_OK);
    CHECK(mesher_export(&domain, &out) == MESHER_OK);
    CHECK(near(judge(&s, &out, 1, 1), 64));
    for (i = 0; i < 4 * out.num_tets; i++) used |= out.tets[i] == point;
    CHECK(!used && out.num_vertices == s.num_vertices);
    CHECK(report.counts[MESHER_NOTE_UNUSED_VERTEX] == 2);
    mesher_output_free(&domain, &out);
    mesher_domain_free(&domain);
}

static void sheets_lines_and_points(void)
{
    mesher_options o = recover_only();
    uint32_t a, b, c;
    clear();
    add_box(0, 0, 0, 4);
    a = add_point(1, 1, 1);
    b = add_point(3, 1, 1.5);
    c = add_point(1.5, 3, 2);
    add_triangle(a, b, c); /* a sheet */
    add_line(a, add_point(0.5, 2, 3)); /* hangs on it */
    add_line(add_point(2, 2, 3), add_point(3, 3, 3.5)); /* free */
    add_point(1, 3, 1);
    add_point(3.5, 3.5, 0.5);
    CHECK(near(mesh_and_judge(&o, 1, 1), 64));
    CHECK(report.counts[MESHER_NOTE_SHEET] == 1 && report.counts[MESHER_NOTE_UNUSED_VERTEX] == 2);
    CHECK(report.counts[MESHER_NOTE_OPEN_EDGE] == 3);
    clear(); /* isolated points inside are vertices, one on a facet and one outside are orphans */
    add_box(0, 0, 0, 4);
    a = add_point(1, 2, 3);
    b = add_point(2, 1, 0);
    c = add_point(5, 5, 5);
    add_point(1, 2, 3); /* each twice: the second one is never a vertex */
    add_point(2, 1, 0);
    add_point(5, 5, 5);
    for (o.drop_unused = 0; o.drop_unused < 2; o.drop_unused++) { /* and all of them, if asked */
        mesher_surface s = surface_of(&shape);
        mesher_domain domain;
        mesher_output out;
        uint64_t i;
        int used[14] = {0};
        prepare();
        CHECK(mesher_mesh(&domain, &s, &o, &report) == MESHER_OK);
        CHECK(mesher_export(&domain, &out) == MESHER_OK);
        CHECK(near(judge(&s, &out, 1, 1), 64));
        for (i = 0; i < 4 * out.num_tets; i++)
            if (out.tets[i] < 14) used[out.tets[i]] = 1;
        CHECK(used[a] == !o.drop_unused && !used[b] && !used[c]);
        CHECK(!used[11] && !used[12] && !used[13]);
        CHECK(report.counts[MESHER_NOTE_UNUSED_VERTEX] == 3);
        CHECK(report.counts[MESHER_NOTE_DUPLICATE_VERTEX] == 3);
        CHECK(out.num_vertices == 14);
        mesher_output_free(&domain, &out);
        mesher_domain_free(&domain);
    }
    leave_out(a);
}

/* What bounds each region: neighbours and tags; a line outside is not meshed, and said. */
static void region_graph(void)
{
    mesher_options o = recover_only();
    mesher_surface s;
    mesher_domain domain;
    static int32_t tags[MOST_TRIANGLES];
    int32_t some[3] = {0, 0, 0};
    size_t count = 0;
    uint32_t i, walls = 0;
    clear();
    add_box(0, 0, 0, 4);
    add_box(1, 1, 1, 2); /* within */
    add_line(add_point(5, 5, 5), add_point(6, 6, 7));
    for (i = 0; i < 24; i++) tags[i] = i < 12 ? -(int32_t)(i / 6) : INT32_MAX - (int32_t)(i % 2);
    s = surface_of(&shape);
    s.triangle_tags = tags;
    prepare();
    CHECK(mesher_mesh(&domain, &s, &o, &report) == MESHER_OK);
    CHECK(report.counts[MESHER_NOTE_OUTSIDE_LINE] == 1);
    CHECK(domain.num_regions == 2 && domain.regions[0].first_facet == 0 &&
          domain.regions[1].first_facet == 12);
    for (i = 0; i < domain.num_facets; i++) {
        const uint32_t *sides = domain.facet_sides + 2 * i;
        CHECK(domain.facet_source[i] < 12 ? sides[0] == 1 && sides[1] == 0
                                          : sides[0] == 2 && sides[1] == 1);
        walls++;
    }
    CHECK(walls == 24);
    CHECK(mesher_region_tags(&domain, 0, some, 3, &count) == MESHER_OK && count == 4);
    CHECK(some[0] == -1 && some[1] == 0 && some[2] == INT32_MAX - 1);
    CHECK(mesher_region_tags(&domain, 1, NULL, 0, &count) == MESHER_OK && count == 2);
    CHECK(mesher_region_tags(&domain, 2, NULL, 0, &count) == MESHER_ERROR_INVALID_ARGUMENT);
    mesher_domain_free(&domain);
}

/* Every triangle with its own vertices, some turned, some twice. */
static void soup(void)
{
    mesher_options o = recover_only();
    static model welded;
    size_t i, j;
    clear();
    add_torus(0, 0, 0, 12, 7);
    welded = shape;
    clear();
    for (i = 0; i < welded.nt; i++) {
        uint32_t v[3];
        for (j = 0; j < 3; j++) {
            const double *x = welded.xyz + 3 * welded.triangles[3 * i + j];
            v[j] = add_point(x[0], x[1], x[2]);
        }
        if (i % 3) add_triangle(v[0], v[1], v[2]);
        else add_triangle(v[1], v[0], v[2]);
        if (i % 7 == 0) add_triangle(v[2], v[0], v[1]);
    }
    CHECK(mesh_and_judge(&o, 1, 1) > 2);
    CHECK(report.counts[MESHER_NOTE_DUPLICATE_VERTEX] == 3 * welded.nt - welded.nv);
}

static void scaled_and_shifted(void)
{
    mesher_options o = recover_only();
    static const double scales[4] = {1e-6, 1e6, 1e-12, 1e12};
    int i;
    size_t k;
    for (i = 0; i < 4; i++) {
        clear();
        add_sphere(0.1, 0.2, 0.3, 1, 8, 9);
        for (k = 0; k < 3 * shape.nv; k++) shape.xyz[k] *= scales[i];
        CHECK(mesh_and_judge(&o, 1, 1) > 3 * scales[i] * scales[i] * scales[i]);
    }
    clear();
    add_sphere(1e6, 1e6, 1e6, 1, 8, 9);
    CHECK(mesh_and_judge(&o, 1, 1) > 3);
}

static void seeds_choose_cells(void)
{
    mesher_options o = recover_only();
    double seeds[6] = {0.1, 0.2, 0.3, 2.5, 0.5, 0.25};
    int32_t tags[2] = {0, 4};
    mesher_surface s;
    mesher_domain domain;
    clear();
    add_box(0, 0, 0, 1);
    add_box(2, 0, 0, 1);
    add_box(4, 0, 0, 1);
    s = surface_of(&shape);
    s.seeds = seeds;
    s.seed_tags = tags;
    o.regions = MESHER_REGIONS_SEEDS;
    s.num_seeds = 2;
    prepare();
    CHECK(mesher_mesh(&domain, &s, &o, &report) == MESHER_OK);
    CHECK(report.num_regions == 1 && domain.num_regions == 3 && domain.regions[1].number == 4);
    mesher_domain_free(&domain);
    s.num_seeds = 1; /* a hole, and nothing else: the others stay */
    CHECK(mesher_mesh(&domain, &s, &o, &report) == MESHER_OK);
    CHECK(report.num_regions == 2 && !domain.regions[0].kept && domain.regions[1].number == 1);
    CHECK(near(domain.regions[2].volume, 1) && domain.regions[2].depth == 1 &&
          domain.regions[2].winding == 1);
    CHECK(domain.regions[2].first_facet == 24);
    mesher_domain_free(&domain);
}

/* -- Refinement keeps all of it. */

static void refined(void)
{
    mesher_options o;
    memset(&o, 0, sizeof o);
    clear();
    add_box(0, 0, 0, 1);
    add_box(0.25, 0.25, 0.25, 0.5);
    o.size = 0.2;
    CHECK(near(mesh_and_judge(&o, 2, 1), 1));
    CHECK(report.refined_vertices > 20);
    CHECK(report.num_vertices == 16 + report.refined_vertices + report.interior_steiner);
    random_voxels(3);
    clear();
    o.size = 0.6;
    {
        int cells = voxel_surface();
        CHECK(mesh_and_judge(&o, (uint32_t)cells, 1) > 10);
    }
    clear();
    add_torus(0, 0, 0, 24, 12);
    o.size = 0;
    CHECK(mesh_and_judge(&o, 1, 1) > 2.5);
}

/* -- Invalid surfaces. */

static mesher_result mesh_code(const mesher_options *o)
{
    mesher_surface s = surface_of(&shape);
    mesher_domain domain;
    mesher_result result;
    static const mesher_domain zero;
    prepare();
    result = mesher_mesh(&domain, &s, o, &report);
    if (result < 0) {
        CHECK(memcmp(&domain, &zero, sizeof zero) == 0);
        CHECK(report.message[0] != 0);
    }
    mesher_domain_free(&domain);
    return result;
}

static void invalid_surfaces(void)
{
    mesher_options o = recover_only();
    clear();
    add_torus(0, 0, 0, 24, 12);
    add_torus(1, 0.02, 0.01, 24, 12); /* crossing */
    CHECK(mesh_code(&o) == MESHER_ERROR_SURFACE);
    CHECK(report.counts[MESHER_DEFECT_INTERSECTION] > 20 && strstr(report.message, "intersect"));
    CHECK(findings[0].kind == MESHER_DEFECT_INTERSECTION);
    clear();
    add_torus(0, 0, 0, 24, 12);
    shape.nt--; /* open */
    CHECK(mesh_code(&o) == MESHER_ERROR_SURFACE);
    CHECK(report.counts[MESHER_DEFECT_NO_CELL] == 1);
    clear();
    CHECK(mesh_code(&o) == MESHER_ERROR_SURFACE);
    add_box(0, 0, 0, 1);
    add_triangle(0, 1, add_point(0.5, -1, -1)); /* a fin outside */
    CHECK(mesh_code(&o) == MESHER_ERROR_SURFACE);
    CHECK(report.counts[MESHER_DEFECT_OUTSIDE_FACET] == 1 && findings[0].triangles[0] == 12);
    o.drop_outside = 1;
    CHECK(mesh_code(&o) == MESHER_OK && report.counts[MESHER_NOTE_OUTSIDE_FACET] == 1);
    o.drop_outside = 0;
    clear();
    add_box(0, 0, 0, 1);
    shape.xyz[5] = (double)NAN;
    CHECK(mesh_code(&o) == MESHER_ERROR_SURFACE);
    CHECK(report.counts[MESHER_DEFECT_NOT_FINITE] == 1);
}

/* A tetrahedron whose tip pokes through the floor of a box, touches it, and does not. */
static void a_tip_meets_a_floor(void)
{
    mesher_options o = recover_only();
    uint32_t a, b, c, d;
    clear();
    add_box(0, 0, 0, 4);
    a = add_point(1, 1.5, 1);
    b = add_point(2, 1.5, 1);
    c = add_point(1.5, 2.5, 1);
    d = add_point(1.5, 1.8, -1);
    add_triangle(a, b, c);
    add_triangle(a, d, b);
    add_triangle(b, d, c);
    add_triangle(c, d, a);
    CHECK(mesh_code(&o) == MESHER_ERROR_SURFACE);
    CHECK(report.counts[MESHER_DEFECT_INTERSECTION] >= 3);
    shape.xyz[3 * 11 + 2] = 0; /* exactly on the floor */
    CHECK(mesh_code(&o) == MESHER_ERROR_SURFACE);
    CHECK(report.counts[MESHER_DEFECT_T_JUNCTION] >= 3 && findings[0].vertices[0] == 11);
    shape.xyz[3 * 11 + 2] = 0.001; /* just above */
    CHECK(mesh_code(&o) == MESHER_OK);
}

/* Two boxes side by side, their common wall with the same diagonals, and with others. */
static void walls_have_one_diagonal(void)
{
    static const uint32_t one[2][3] = {{1, 3, 7}, {1, 7, 5}};
    static const uint32_t same[2][3] = {{8, 12, 14}, {8, 14, 10}},
                          other[2][3] = {{8, 12, 10}, {12, 14, 10}};
    mesher_options o = recover_only();
    mesher_result code;
    size_t i;
    int t;
    for (t = 0; t < 2; t++) {
        clear();
        add_box(0, 0, 0, 1);
        add_box(1, 0, 0, 1);
        shape.nt = 24;
        for (i = 0; i < 2; i++) { /* x = 1: triangles 10, 11 of the first; 20, 21 of the second */
            memcpy(shape.triangles + 3 * (10 + i), one[i], sizeof one[i]);
            memcpy(shape.triangles + 3 * (20 + i), t ? other[i] : same[i], sizeof one[i]);
        }
        code = mesh_code(&o);
        CHECK(code == (t ? MESHER_ERROR_SURFACE : MESHER_OK));
        CHECK((report.counts[MESHER_DEFECT_OVERLAP] > 0) == t);
        if (!t) CHECK(report.num_regions == 2 && report.counts[MESHER_NOTE_OPPOSITE_TRIANGLE] == 2);
    }
}

/* -- Contracts. */

typedef struct counting { long left, live; } counting;
static void *counting_alloc(void *user, size_t size)
{
    counting *c = (counting *)user;
    void *p;
    if (c->left == 0) return NULL;
    if (c->left > 0) c->left--;
    p = malloc(size ? size : 1);
    if (p) c->live++;
    return p;
}
static void counting_release(void *user, void *p)
{
    if (p) ((counting *)user)->live--;
    free(p);
}

static void every_allocation_may_fail(void)
{
    int kind;
    for (kind = 0; kind < 3; kind++) { /* recovered; refined; invalid */
        mesher_options o;
        mesher_result code = MESHER_ERROR_OUT_OF_MEMORY;
        counting c;
        long k;
        memset(&o, 0, sizeof o);
        o.no_refine = kind != 1;
        o.size = 0.4;
        o.host.allocator.alloc = counting_alloc;
        o.host.allocator.release = counting_release;
        o.host.allocator.user = &c;
        clear();
        add_prism(4, 0.5);
        if (kind == 2) add_torus(0, 0, 0, 5, 4);
        for (k = 0; k < 3000 && code == MESHER_ERROR_OUT_OF_MEMORY; k++) {
            mesher_surface s = surface_of(&shape);
            mesher_domain domain;
            mesher_output out;
            prepare();
            c.left = k;
            c.live = 0;
            code = mesher_mesh(&domain, &s, &o, &report);
            CHECK(code >= 0 || code == MESHER_ERROR_OUT_OF_MEMORY ||
                  (kind == 2 && code == MESHER_ERROR_SURFACE) ||
                  (kind == 2 && code == MESHER_ERROR_RECOVERY));
            if (kind == 2 && code == MESHER_ERROR_RECOVERY)
                code = MESHER_ERROR_OUT_OF_MEMORY; /* no memory to explain */
            if (code >= 0) {
                code = mesher_export(&domain, &out);
                CHECK(code == MESHER_OK || code == MESHER_ERROR_OUT_OF_MEMORY);
                if (code == MESHER_OK) judge(&s, &out, 1, 1);
                mesher_output_free(&domain, &out);
            }
            mesher_domain_free(&domain);
            CHECK(c.live == 0);
        }
        CHECK(k > 20 && k < 3000);
        CHECK(code == (kind == 2 ? MESHER_ERROR_SURFACE : MESHER_OK));
    }
}

typedef struct canceller { int left; } canceller;
/* A fraction of -1: not known. */
static int cancel_later(void *user, const char *phase, double fraction)
{
    canceller *c = (canceller *)user;
    return phase == NULL || !(fraction >= -1 && fraction <= 1) || c->left-- == 0;
}

/* All time is up as soon as it says so. */
static double hurried(void *user) { return ((const canceller *)user)->left < 0 ? 1e9 : 0; }

static void progress_cancels(int hurry)
{
    mesher_options o;
    canceller c;
    int k, cancelled = 0;
    memset(&o, 0, sizeof o);
    o.host.progress = cancel_later;
    o.host.user = &c;
    o.size = hurry ? 0.06 : 0.3;
    if (hurry) {
        o.host.clock = hurried;
        o.max_seconds = 1e6;
    }
    clear();
    add_torus(0, 0, 0, 24, 12);
    for (k = 0; k < 1000000; k += hurry ? 1 : 1 + k / 3) {
        mesher_result code;
        c.left = k;
        code = mesh_code(&o);
        CHECK(code == (c.left < 0 ? MESHER_CANCELLED : MESHER_OK));
        if (code >= 0) break;
        cancelled++;
    }
    CHECK(cancelled >= 3 && k < 1000000);
}

/* The vertices of the last mesh within a box. */
static uint64_t num_within(const mesher_domain *d, const double *lo, const double *hi)
{
    uint64_t num = 0;
    uint32_t v;
    int k, in;
    for (v = 1; v < d->mesh.num_vertices; v++) {
        const double *x = d->mesh.vertices[v].x;
        for (in = 1, k = 0; k < 3; k++) in = in && x[k] >= lo[k] && x[k] <= hi[k];
        num += in != 0;
    }
    return num;
}

/* A box of twelve triangles, and something small: in its corner, on its side, on a vertex. Its size
 * is there whatever is above it. */
static void small_wishes_beside_large_triangles(void)
{
    static const struct {
        mesher_shape shape;
        double xyz[6], radius, lo, hi;
    } wish[] = {{MESHER_SHAPE_BALL, {.1, .1, .1, 0, 0, 0}, .04, .06, .14},
                {MESHER_SHAPE_BALL, {0, 0, 0, 0, 0, 0}, .1, 0, .1},
                {MESHER_SHAPE_BALL, {.5, .5, 0, 0, 0, 0}, .1, 0, 1},
                {MESHER_SHAPE_BOX, {0, 0, 0, .1, .1, .1}, 0, 0, .1},
                {MESHER_SHAPE_SEGMENT, {0, 0, 0, 1, 0, 0}, .06, 0, 1}};
    size_t k;
    clear();
    add_box(0, 0, 0, 1);
    for (k = 0; k < sizeof wish / sizeof *wish; k++) {
        mesher_surface s = surface_of(&shape);
        mesher_domain domain;
        mesher_options o;
        mesher_source source;
        double lo[3], hi[3];
        int i;
        memset(&o, 0, sizeof o);
        memset(&source, 0, sizeof source);
        source.shape = wish[k].shape;
        memcpy(source.xyz, wish[k].xyz, sizeof wish[k].xyz);
        source.radius = wish[k].radius;
        source.size = 0.01;
        o.sources = &source;
        o.num_sources = 1;
        for (i = 0; i < 3; i++) lo[i] = wish[k].lo, hi[i] = wish[k].hi;
        CHECK(mesher_mesh(&domain, &s, &o, NULL) == MESHER_OK);
        CHECK(num_within(&domain, lo, hi) > 400);
        CHECK(delaunay_validate(&domain.mesh, DELAUNAY_VALIDATE_GEOMETRY, NULL) == DELAUNAY_OK);
        mesher_domain_free(&domain);
    }
}

/* A plate of twelve triangles: nothing but the middle of it is between its sides. */
static void plates_have_layers(void)
{
    static const double lo[3] = {0.1, 0.1, 0.01}, hi[3] = {0.9, 0.9, 0.09};
    int layers, k;
    clear();
    add_box(0, 0, 0, 1);
    for (k = 0; k < 8; k++) shape.xyz[3 * k + 2] *= 0.1;
    for (layers = 2; layers < 5; layers++) {
        mesher_surface s = surface_of(&shape);
        mesher_domain domain;
        mesher_options o;
        memset(&o, 0, sizeof o);
        o.layers = layers;
        CHECK(mesher_mesh(&domain, &s, &o, NULL) == MESHER_OK);
        CHECK(num_within(&domain, lo, hi) > 50u * (unsigned)(layers * layers));
        mesher_domain_free(&domain);
    }
}

/* A sheet so thin that tetrahedra of its thickness would be thousands of millions. */
static void thin_sheets_are_not_filled(void)
{
    mesher_surface s;
    mesher_domain domain;
    mesher_options o;
    uint32_t v;
    int k;
    clear();
    add_box(0, 0, 0, 1);
    for (k = 0; k < 8; k++) shape.xyz[3 * k + 2] *= 1e-5;
    s = surface_of(&shape);
    memset(&o, 0, sizeof o);
    o.layers = 4;
    o.max_vertices = 20000; /* would end it, with another result */
    CHECK(mesher_mesh(&domain, &s, &o, NULL) == MESHER_OK);
    for (v = 1; v <= domain.mesh.num_points; v++)
        if (domain.size[v] > 0) CHECK(domain.size[v] >= 0.99 / 64);
    CHECK(delaunay_validate(&domain.mesh, DELAUNAY_VALIDATE_GEOMETRY, NULL) == DELAUNAY_OK);
    mesher_domain_free(&domain);
}

static uint64_t hash_bytes(uint64_t h, const void *bytes, size_t n)
{
    const unsigned char *p = (const unsigned char *)bytes;
    size_t i;
    for (i = 0; i < n; i++) h = (h ^ p[i]) * UINT64_C(1099511628211);
    return h;
}

static uint64_t mesh_hash(int threads, int refine)
{
    mesher_surface s = surface_of(&shape);
    mesher_options o;
    mesher_domain domain;
    mesher_output out;
    uint64_t h = 14695981039346656037u;
    memset(&o, 0, sizeof o);
    o.host.num_threads = threads;
    o.no_refine = !refine;
    prepare();
    if (mesher_mesh(&domain, &s, &o, &report) < 0 || mesher_export(&domain, &out) != MESHER_OK)
        return 0;
    h = hash_bytes(h, out.xyz, 3 * (size_t)out.num_vertices * sizeof *out.xyz);
    h = hash_bytes(h, out.tets, 4 * (size_t)out.num_tets * sizeof *out.tets);
    h = hash_bytes(h, out.regions, (size_t)out.num_tets * sizeof *out.regions);
    mesher_output_free(&domain, &out);
    mesher_domain_free(&domain);
    return h;
}

static void same_bytes_for_any_threads(void)
{
    static const int threads[4] = {1, 2, 3, 8};
    int i, k;
    for (k = 0; k < 4; k++) {
        uint64_t first = 0;
        clear();
        if (k < 2) {
            add_torus(0, 0, 0, 40, 24);
            add_sphere(0, 0, 0, 0.5, 12, 20);
        } else {
            random_voxels(3);
            voxel_surface();
        }
        for (i = 0; i < 4; i++) {
            uint64_t h = mesh_hash(threads[i], k & 1);
            if (i == 0) first = h;
            CHECK(h != 0 && h == first);
        }
    }
}

/* A stage that is not next says so, and changes nothing. */
static void stages_come_in_order(const mesher_surface *s, const mesher_options *o)
{
    typedef mesher_result (*stage)(mesher_domain *, mesher_report *);
    const stage stages[] = {mesher_empty_mesh, mesher_recover, mesher_color, mesher_size,
                            mesher_refine};
    mesher_domain domain;
    mesher_report last;
    int next, k;
    memset(&domain, 0, sizeof domain);
    memset(&last, 0, sizeof last);
    for (k = 0; k < 5; k++) CHECK(stages[k](&domain, NULL) == MESHER_ERROR_INVALID_ARGUMENT);
    for (k = 0; k < 5; k++) CHECK(stages[k](NULL, NULL) == MESHER_ERROR_INVALID_ARGUMENT);
    CHECK(mesher_domain_init(&domain, s, o, NULL) == MESHER_OK);
    for (next = 0; next < 5; next++) {
        for (k = 0; k < 5; k++)
            if (k < 2 ? k != next : k == 2 ? next < 2 : next <= 2) {
                last.message[0] = 0;
                CHECK(stages[k](&domain, NULL) == MESHER_ERROR_INVALID_ARGUMENT);
                CHECK(stages[k](&domain, &last) == MESHER_ERROR_INVALID_ARGUMENT);
                CHECK(strstr(last.message, "stage") != NULL);
            }
        strcpy(last.message, "of another call");
        CHECK(stages[next](&domain, &last) == MESHER_OK && last.message[0] == 0);
    }
    CHECK(delaunay_validate(&domain.mesh, DELAUNAY_VALIDATE_GEOMETRY, NULL) == DELAUNAY_OK);
    mesher_domain_free(&domain);
}

static void arguments_are_checked(void)
{
    mesher_surface s;
    mesher_domain domain;
    mesher_output out;
    mesher_options o = recover_only();
    clear();
    add_box(0, 0, 0, 1);
    s = surface_of(&shape);
    CHECK(mesher_mesh(NULL, &s, NULL, NULL) == MESHER_ERROR_INVALID_ARGUMENT);
    memset(&domain, 0xAB, sizeof domain);
    CHECK(mesher_mesh(&domain, NULL, NULL, NULL) == MESHER_ERROR_INVALID_ARGUMENT);
    mesher_domain_free(&domain); /* it is zeroed on every failure, and so is an output */
    memset(&domain, 0xAB, sizeof domain);
    CHECK(mesher_refine_mesh(&domain, NULL, NULL, NULL, 0, NULL, NULL) ==
          MESHER_ERROR_INVALID_ARGUMENT);
    mesher_domain_free(&domain);
    o.gradation = -1;
    CHECK(mesher_mesh(&domain, &s, &o, NULL) == MESHER_ERROR_INVALID_ARGUMENT);
    memset(&domain, 0, sizeof domain);
    memset(&out, 0xAB, sizeof out);
    CHECK(mesher_export(&domain, &out) == MESHER_ERROR_INVALID_ARGUMENT);
    CHECK(out.xyz == NULL && out.num_tets == 0);
    mesher_output_free(&domain, &out);
    CHECK(mesher_color(&domain, NULL) == MESHER_ERROR_INVALID_ARGUMENT);
    o.gradation = 0;
    stages_come_in_order(&s, &o);
    CHECK(mesher_mesh(&domain, &s, &o, NULL) == MESHER_OK); /* no report */
    CHECK(mesher_export(&domain, &out) == MESHER_OK && out.num_tets >= 5);
    mesher_output_free(&domain, &out);
    mesher_domain_free(&domain);
    mesher_domain_free(NULL);
    mesher_output_free(NULL, NULL);
}

/* -- Points that somebody else moves after meshing. */

static void moved_points_come_out_where_they_are(void)
{
    mesher_surface s;
    mesher_domain domain;
    mesher_output out;
    uint32_t inner, twin, v, k;
    uint64_t i;
    clear();
    add_box(0, 0, 0, 1);
    inner = add_point(0.5, 0.5, 0.5);
    twin = add_point(0.5, 0.5, 0.5);
    shape.xyz[2] = -0.0; /* of a corner: comes back as it is */
    s = surface_of(&shape);
    memset(&out, 0, sizeof out);
    CHECK(mesher_mesh(&domain, &s, NULL, &report) == MESHER_OK);
    CHECK(mesher_export(&domain, &out) == MESHER_OK);
    CHECK(memcmp(out.xyz, s.xyz, 24 * s.num_vertices) == 0);
    mesher_output_free(&domain, &out);
    v = domain.mesh.vertex_of[inner];
    for (k = 0; k < 3; k++) domain.mesh.vertices[v].x[k] += 0.0625 * (k + 1);
    CHECK(delaunay_validate(&domain.mesh, DELAUNAY_VALIDATE_GEOMETRY, NULL) == DELAUNAY_OK);
    CHECK(mesher_export(&domain, &out) == MESHER_OK);
    CHECK(memcmp(out.xyz, s.xyz, 24 * (size_t)inner) == 0);
    for (k = 0; k < 3; k++) {
        CHECK(out.xyz[3 * inner + k] == 0.5 + 0.0625 * (k + 1));
        CHECK(out.xyz[3 * twin + k] == 0.5 + 0.0625 * (k + 1));
    }
    for (i = 0; i < out.num_tets; i++) {
        const uint32_t *t = out.tets + 4 * i;
        CHECK(delaunay_orient3d(out.xyz + 3 * t[0], out.xyz + 3 * t[1], out.xyz + 3 * t[2],
                                out.xyz + 3 * t[3]) > 0);
    }
    mesher_output_free(&domain, &out);
    mesher_domain_free(&domain);
}

/* -- Every failure has a sentence, and every budget a name. */

static void failures_have_sentences(void)
{
    mesher_surface s;
    mesher_domain domain;
    mesher_fine_surface fine;
    mesher_options o;
    counting c;
    long failed = 0, left;
    int k;
    clear();
    add_box(0, 0, 0, 1);
    s = surface_of(&shape);
    for (k = 0; k < 3; k++) { /* a fine surface; the first stage alone; all stages */
        memset(&c, 0, sizeof c);
        memset(&o, 0, sizeof o);
        o.size = 0.4;
        o.host.num_threads = 1;
        o.host.allocator.alloc = counting_alloc;
        o.host.allocator.release = counting_release;
        o.host.allocator.user = &c;
        for (left = 0; left < 1000; left++) {
            mesher_result result;
            c.left = left;
            memset(&report, 0, sizeof report);
            result = k == 2 ? mesher_mesh(&domain, &s, &o, &report)
                     : k    ? mesher_domain_init(&domain, &s, &o, &report)
                            : mesher_refine_surface(&fine, &s, &o, &report);
            if (k) mesher_domain_free(&domain);
            else mesher_fine_surface_free(&fine);
            CHECK(c.live == 0);
            if (result == MESHER_OK) break;
            CHECK(report.message[0] && report.message[strlen(report.message) - 1] != ' ');
            failed++;
        }
    }
    CHECK(failed > 20);
    memset(&o, 0, sizeof o);
    o.size = -1;
    memset(&report, 0, sizeof report);
    CHECK(mesher_refine_surface(&fine, &s, &o, &report) == MESHER_ERROR_INVALID_ARGUMENT);
    CHECK(strstr(report.message, "options.size is -1"));
    memset(&report, 0, sizeof report);
    CHECK(mesher_domain_init(&domain, &s, &o, &report) == MESHER_ERROR_INVALID_ARGUMENT);
    CHECK(strstr(report.message, "options.size is -1"));
    CHECK(mesher_domain_init(&domain, NULL, &o, &report) == MESHER_ERROR_INVALID_ARGUMENT);
    CHECK(strstr(report.message, "no surface"));
    report.message[0] = 0;
    CHECK(mesher_mesh(&domain, NULL, &o, &report) == MESHER_ERROR_INVALID_ARGUMENT);
    CHECK(strstr(report.message, "no surface"));
    report.message[0] = 0;
    CHECK(mesher_refine_surface(&fine, NULL, &o, &report) == MESHER_ERROR_INVALID_ARGUMENT);
    CHECK(strstr(report.message, "no surface"));
}

static void budgets_have_names(void)
{
    static const char *const names[6] = {"max_vertices, 50",        "max_tets, 200",
                                         "max_seconds, 1e-09",      "host.memory_limit_bytes, ",
                                         "max_vertices, 50",        "max_tets, 200"};
    mesher_surface s;
    mesher_domain domain;
    mesher_fine_surface fine;
    mesher_options o;
    int k;
    clear();
    add_box(0, 0, 0, 1);
    s = surface_of(&shape);
    for (k = 0; k < 6; k++) {
        mesher_result result;
        memset(&o, 0, sizeof o);
        o.size = 0.05;
        if (k % 4 == 0) o.max_vertices = 50;
        if (k % 4 == 1) o.max_tets = 200;
        if (k == 2) o.max_seconds = 1e-9;
        if (k == 3) o.host.memory_limit_bytes = 3000000;
        memset(&report, 0, sizeof report);
        if (k < 4) {
            result = mesher_mesh(&domain, &s, &o, &report);
            mesher_domain_free(&domain);
        } else {
            result = mesher_refine_surface(&fine, &s, &o, &report);
            mesher_fine_surface_free(&fine);
        }
        CHECK(result == MESHER_STOPPED_BY_BUDGET);
        CHECK(strstr(report.message, names[k]) != NULL);
    }
}

int main(void)
{
    cubes();
    touching_cubes();
    voxel_materials();
    round_ones();
    prisms_need_points();
    sheets_lines_and_points();
    region_graph();
    soup();
    scaled_and_shifted();
    seeds_choose_cells();
    refined();
    invalid_surfaces();
    a_tip_meets_a_floor();
    walls_have_one_diagonal();
    every_allocation_may_fail();
    small_wishes_beside_large_triangles();
    plates_have_layers();
    thin_sheets_are_not_filled();
    progress_cancels(0);
    progress_cancels(1);
    same_bytes_for_any_threads();
    arguments_are_checked();
    moved_points_come_out_where_they_are();
    failures_have_sentences();
    budgets_have_names();
    prisms_in_a_box();
    return check_report();
}
