/* Engine (b) of delaunay.h: moves, reconnections, new and removed vertices; the same bytes for any
 * number of threads. */
#ifndef LINKED
#  define DELAUNAY_IMPLEMENTATION
#endif
#include "../delaunay.h"
#include "check.h"
#include <math.h>
#ifdef _OPENMP
#  include <omp.h>
#endif
#include "small_mesh.h"

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

static double quality_of(const delaunay_mesh *m, delaunay_handle t)
{
    const uint32_t *v = m->tets[t].v;
    return compactness(NULL, m->vertices[v[0]].x, m->vertices[v[1]].x, m->vertices[v[2]].x,
                       m->vertices[v[3]].x);
}

/* A vertex to the rounded mean of its neighbours. Data: how many tetrahedra it has. */
static int plan_smoothing(void *user, const delaunay_mesh *m, delaunay_worker *worker, size_t item,
                          delaunay_plan *p)
{
    uint32_t v = 5 + (uint32_t)item;
    double x[3] = {0, 0, 0};
    delaunay_result result = delaunay_vertex_star(m, worker, v, &p->star);
    size_t i;
    int j, k;
    (void)user;
    if (result != DELAUNAY_OK) return result;
    if (p->star.count == 0) return DELAUNAY_PLAN_NOTHING; /* removed */
    for (i = 0; i < p->star.count; i++)
        for (j = 0; j < 4; j++)
            for (k = 0; k < 3; k++)
                if (m->tets[p->star.items[i]].v[j] != v)
                    x[k] += m->vertices[m->tets[p->star.items[i]].v[j]].x[k];
    for (k = 0; k < 3; k++) x[k] = floor(x[k] / (3.0 * (double)p->star.count));
    for (i = 0; i < p->star.count; i++) {
        const uint32_t *q = m->tets[p->star.items[i]].v;
        const double *c[4];
        for (k = 0; k < 4; k++) c[k] = q[k] == v ? x : m->vertices[q[k]].x;
        if (delaunay_orient3d(c[0], c[1], c[2], c[3]) <= 0) return DELAUNAY_PLAN_NOTHING;
    }
    p->data[0] = p->star.count;
    return delaunay_plan_move(p, v, x, p->star.items, p->star.count);
}

/* A tetrahedron and its neighbours: the best worst quality. The item is a slot, which may have
 * changed hands. */
static int plan_reconnection(void *user, const delaunay_mesh *m, delaunay_worker *worker,
                             size_t item, delaunay_plan *p)
{
    delaunay_window window;
    delaunay_search search;
    delaunay_handle tets[5], t = 1 + (delaunay_handle)item;
    size_t n = 0, i;
    (void)user;
    if (delaunay_is_deleted(m, t)) return DELAUNAY_PLAN_NOTHING;
    tets[n++] = t;
    for (i = 0; i < 4; i++)
        if (m->tets[t].n[i]) tets[n++] = m->tets[t].n[i] / 4;
    if (!delaunay_window_set(&window, m, tets, n, 8, 1, 1)) return DELAUNAY_PLAN_NOTHING;
    memset(&search, 0, sizeof search);
    search.objective = DELAUNAY_BEST_QUALITY;
    search.quality = compactness;
    search.bound = 1e300;
    for (i = 0; i < n; i++)
        if (quality_of(m, tets[i]) < search.bound) search.bound = quality_of(m, tets[i]);
    if (!delaunay_reconnect(m, worker, &window, &search)) return DELAUNAY_PLAN_NOTHING;
    return delaunay_plan_window(p, &window, &search);
}

/* A tetrahedron is split at a lattice point inside it, if its mean is one. */
static int plan_split(void *user, const delaunay_mesh *m, delaunay_worker *worker, size_t item,
                      delaunay_plan *p)
{
    delaunay_handle t = 1 + (delaunay_handle)item;
    const uint32_t *v = m->tets[t].v;
    double x[3];
    int i, k, answer;
    (void)user;
    (void)worker;
    if (v[0] == 0) return DELAUNAY_PLAN_NOTHING;
    for (k = 0; k < 3; k++) {
        x[k] = 0;
        for (i = 0; i < 4; i++) x[k] += m->vertices[v[i]].x[k];
        x[k] = floor(x[k] / 4);
    }
    answer = delaunay_plan_remove(p, t);
    if (answer > 0) answer = delaunay_plan_vertex(p, x);
    for (i = 0; i < 4 && answer > 0; i++) {
        const uint8_t *f = delaunay_facet_order(i);
        if (delaunay_orient3d(m->vertices[v[f[0]]].x, m->vertices[v[f[1]]].x,
                              m->vertices[v[f[2]]].x, x) >= 0)
            return DELAUNAY_PLAN_NOTHING;
        answer = delaunay_plan_add(p, v[f[0]], v[f[2]], v[f[1]], DELAUNAY_PLAN_VERTEX(0));
    }
    return answer;
}

/* A vertex is removed, if its star can be filled without it. */
static int plan_removal(void *user, const delaunay_mesh *m, delaunay_worker *worker, size_t item,
                        delaunay_plan *p)
{
    delaunay_window window;
    delaunay_search search;
    uint32_t v = 5 + (uint32_t)item, i;
    delaunay_result result = delaunay_vertex_star(m, worker, v, &p->star);
    (void)user;
    if (result != DELAUNAY_OK) return result;
    if (!delaunay_window_set(&window, m, p->star.items, p->star.count, 20, 1, 1))
        return DELAUNAY_PLAN_NOTHING;
    for (i = 0; window.vertices[i] != v; i++) {}
    window.dropped = 1u << i;
    memset(&search, 0, sizeof search);
    search.objective = DELAUNAY_ANY;
    search.max_nodes = 300;
    if (!delaunay_reconnect(m, worker, &window, &search)) return DELAUNAY_PLAN_NOTHING;
    return delaunay_plan_window(p, &window, &search);
}

typedef struct client {
    size_t   calls, last, stop_after, touched;
    uint64_t sum;
    delaunay_engine *engine;
} client;

static int done(void *user, delaunay_mesh *m, delaunay_worker *worker, size_t item,
                const delaunay_plan *p)
{
    client *c = (client *)user;
    size_t i;
    (void)worker;
    c->calls++;
    c->sum = c->sum * 31 + item * 2 + (uint64_t)p->committed;
    for (i = 0; p->committed && i < p->num_tets; i++)
        CHECK(!memcmp(m->tets[p->slots.items[i]].v, p->tets + 4 * i, 16) &&
              delaunay_engine_version(c->engine, p->slots.items[i]) ==
                  delaunay_engine_round(c->engine));
    if (p->committed && p->num_moved) CHECK(p->data[0] > 3);
    if (p->committed && p->num_tets && c->touched < 5) { /* a mark, as recovery makes them */
        delaunay_handle t = p->slots.items[0];
        delaunay_mark_facet(m, 4 * t, 1);
        CHECK(delaunay_engine_touch(c->engine, t) == DELAUNAY_OK);
        if (m->tets[t].n[0])
            CHECK(delaunay_engine_touch(c->engine, m->tets[t].n[0] / 4) == DELAUNAY_OK);
        c->touched++;
    }
    return c->stop_after && c->calls >= c->stop_after;
}

static uint64_t hash_bytes(uint64_t h, const void *data, size_t n)
{
    const unsigned char *p = (const unsigned char *)data;
    while (n--) h = (h ^ *p++) * 1099511628211u;
    return h;
}

static uint64_t hash_mesh(const delaunay_mesh *m)
{
    uint64_t h = 14695981039346656037u;
    h = hash_bytes(h, m->tets + 1, (m->num_tets - 1) * sizeof *m->tets);
    h = hash_bytes(h, m->flags + 1, (m->num_tets - 1) * sizeof *m->flags);
    h = hash_bytes(h, m->free_tets, m->num_free * sizeof *m->free_tets);
    h = hash_bytes(h, m->vertex_tet, m->num_vertices * sizeof *m->vertex_tet);
    h = hash_bytes(h, m->vertices, m->num_vertices * sizeof *m->vertices);
    return h;
}

/* All kinds of edits in turn; returns a hash of the mesh and of what done() saw; 0: the code of a
 * failure. */
static uint64_t edit(delaunay_mesh *m, int threads, const delaunay_host *base,
                     delaunay_worker *lent, uint32_t batch, delaunay_result *result,
                     uint64_t *conflicts)
{
    delaunay_host host;
    delaunay_engine *engine;
    delaunay_speculation job;
    client c;
    int step;
    double total = small_total(m);
    memset(&host, 0, sizeof host);
    if (base) host = *base;
    host.num_threads = threads;
    host.clock = check_hasty_clock;
    memset(&c, 0, sizeof c);
    *result = DELAUNAY_ERROR_OUT_OF_MEMORY;
    engine = lent ? delaunay_engine_new_lent(m, &host, lent) : delaunay_engine_new(m, &host);
    c.engine = engine;
    if (!engine) return 0;
    CHECK(delaunay_engine_worker(engine, 0) != NULL);
    CHECK(!lent ||
          (delaunay_engine_worker(engine, 0) == lent && !delaunay_engine_worker(engine, 1)));
    for (step = 0; step < 8; step++) {
        memset(&job, 0, sizeof job);
        job.user = &c;
        job.done = done;
        job.batch = batch;
        job.scatter = step & 1;
        job.plan = step % 4 == 0   ? plan_smoothing
                   : step % 4 == 1 ? plan_reconnection
                   : step % 4 == 2 ? plan_split
                                   : plan_removal;
        job.num_items = step % 4 == 0 || step % 4 == 3 ? m->num_vertices - 5 : m->num_tets - 1;
        if (step == 7) job.num_items = 100;
        *result = delaunay_speculate(engine, &job);
        if (*result != DELAUNAY_OK) break;
        if (base == NULL)
            CHECK((job.commits > 0 || step == 7) && small_valid(m) && small_total(m) == total);
        *conflicts += job.conflicts;
    }
    delaunay_engine_free(engine);
    return *result == DELAUNAY_OK ? hash_mesh(m) ^ c.sum : 0;
}

static void threads_do_not_matter(void)
{
    static const int threads[] = {1, 2, 3, 7, 7}; /* the last time with a worker that was in use */
    uint32_t batches[] = {0, 1, 50};
    int i, b;
    for (b = 0; b < 3; b++) {
        uint64_t first = 0;
        for (i = 0; i < (b == 0 ? 5 : 2); i++) {
            delaunay_mesh m;
            delaunay_worker *w = NULL;
            delaunay_result result;
            uint64_t hash, conflicts = 0;
            small_state = 777;
            CHECK(small_delaunay(&m, &w, NULL, 200));
            hash = edit(&m, threads[i], NULL, i == 4 ? w : NULL, batches[b], &result, &conflicts);
            CHECK(result == DELAUNAY_OK && hash != 0);
            CHECK(b == 1 ? conflicts == 0 : conflicts > 100);
            if (i == 0) first = hash;
            CHECK(hash == first);
            delaunay_worker_free(w);
            delaunay_mesh_free(&m);
        }
    }
}

#ifdef _OPENMP
static int more_threads(void *user, const char *phase, double done_part)
{
    (void)user;
    (void)phase;
    (void)done_part;
    omp_set_num_threads(8);
    return 0;
}

/* OpenMP's default may rise after an engine was made: it has workers for the threads of then. */
static void an_engine_keeps_its_threads(void)
{
    delaunay_mesh m;
    delaunay_worker *w = NULL;
    delaunay_host host;
    delaunay_result result;
    uint64_t conflicts = 0;
    int usual = omp_get_max_threads();
    memset(&host, 0, sizeof host);
    host.progress = more_threads;
    small_state = 777;
    CHECK(small_delaunay(&m, &w, NULL, 200));
    omp_set_num_threads(2);
    CHECK(edit(&m, 0, &host, NULL, 0, &result, &conflicts) != 0);
    CHECK(result == DELAUNAY_OK && small_valid(&m));
    omp_set_num_threads(usual);
    delaunay_worker_free(w);
    delaunay_mesh_free(&m);
}
#endif

/* What each plan saw was still so when it was committed: the worst quality of a window never falls.
 * Its own items are the only writers, so a fall would be a conflict that was not seen. */
static void stale_plans_are_made_again(void)
{
    delaunay_mesh m;
    delaunay_worker *w = NULL;
    delaunay_engine *engine;
    delaunay_speculation job;
    delaunay_handle t;
    double before = 1e300, after = 1e300;
    small_state = 4321;
    CHECK(small_delaunay(&m, &w, NULL, 300));
    for (t = 1; t < m.num_tets; t++)
        if (!delaunay_is_deleted(&m, t) && quality_of(&m, t) < before) before = quality_of(&m, t);
    engine = delaunay_engine_new(&m, NULL);
    memset(&job, 0, sizeof job);
    job.plan = plan_reconnection;
    job.num_items = m.num_tets - 1;
    CHECK(delaunay_speculate(engine, &job) == DELAUNAY_OK);
    CHECK(job.plans > job.num_items && job.rounds > 1); /* some had to be made again ... */
    CHECK(job.plans < job.num_items + job.conflicts);             /* ... and some were kept */
    for (t = 1; t < m.num_tets; t++)
        if (!delaunay_is_deleted(&m, t) && quality_of(&m, t) < after) after = quality_of(&m, t);
    CHECK(after >= before && small_valid(&m));
    delaunay_engine_free(engine);
    delaunay_worker_free(w);
    delaunay_mesh_free(&m);
}

/* Vertices far from each other, and a tetrahedron of each. */
typedef struct chain {
    uint32_t        v[10], count;
    delaunay_handle t[10];
} chain;
#define CHAIN_STEP (1.0 / (1 << 30))

/* Moves a vertex by one step more than twice what the one before has moved by, which it reads. */
static int plan_chain(void *user, const delaunay_mesh *m, delaunay_worker *worker, size_t item,
                      delaunay_plan *p)
{
    const chain *c = (const chain *)user;
    double x[3], before = 0;
    int answer = delaunay_vertex_star(m, worker, c->v[item], &p->star);
    if (answer != DELAUNAY_OK) return answer;
    memcpy(x, m->vertices[c->v[item]].x, sizeof x);
    if (item > 0) {
        const double *y = m->vertices[c->v[item - 1]].x;
        answer = delaunay_plan_read(p, c->t[item - 1]);
        if (answer != DELAUNAY_PLAN_COMMIT) return answer;
        before = y[0] - floor(y[0]);
    }
    x[0] += 2 * before + CHAIN_STEP;
    return delaunay_plan_move(p, c->v[item], x, p->star.items, p->star.count);
}

static int share_a_tetrahedron(const delaunay_mesh *m, uint32_t a, uint32_t b)
{
    delaunay_handle t;
    for (t = 1; t < m->num_tets; t++)
        if (!delaunay_is_deleted(m, t) && delaunay_local_index(&m->tets[t], a) >= 0 &&
            delaunay_local_index(&m->tets[t], b) >= 0)
            return 1;
    return 0;
}

/* A plan that reads what an earlier one in the list writes, and nothing else of it, sees it
 * written. */
static void what_a_plan_reads_counts(void)
{
    int threads;
    for (threads = 1; threads <= 4; threads++) {
        delaunay_mesh m;
        delaunay_worker *w = NULL;
        delaunay_engine *engine;
        delaunay_speculation job;
        delaunay_host host;
        chain c;
        uint32_t v, i;
        memset(&host, 0, sizeof host);
        host.num_threads = threads;
        small_state = 99;
        CHECK(small_delaunay(&m, &w, NULL, 150));
        memset(&c, 0, sizeof c);
        for (v = 5; v < m.num_vertices && c.count < 10; v++) {
            if (c.count > 0 && share_a_tetrahedron(&m, v, c.v[c.count - 1])) continue;
            c.v[c.count] = v;
            c.t[c.count++] = m.vertex_tet[v];
        }
        CHECK(c.count == 10);
        engine = delaunay_engine_new(&m, &host);
        memset(&job, 0, sizeof job);
        job.num_items = 10;
        job.plan = plan_chain;
        job.user = &c;
        CHECK(delaunay_speculate(engine, &job) == DELAUNAY_OK && job.commits == 10);
        for (i = 0; i < c.count; i++) {
            double x = m.vertices[c.v[i]].x[0];
            CHECK(x - floor(x) == (double)((2u << i) - 1) * CHAIN_STEP);
        }
        CHECK(small_valid(&m));
        delaunay_engine_free(engine);
        delaunay_worker_free(w);
        delaunay_mesh_free(&m);
    }
}

static int plan_broken(void *user, const delaunay_mesh *m, delaunay_worker *worker, size_t item,
                       delaunay_plan *p)
{
    (void)user;
    (void)worker;
    if (item < 10 || delaunay_is_deleted(m, 1 + (delaunay_handle)item))
        return DELAUNAY_PLAN_NOTHING;
    return delaunay_plan_remove(p, 1 + (delaunay_handle)item); /* and nothing in its place */
}

static int plan_error(void *user, const delaunay_mesh *m, delaunay_worker *worker, size_t item,
                      delaunay_plan *p)
{
    if (item == 37) return DELAUNAY_ERROR_INTERNAL;
    if (item == 38) return DELAUNAY_ERROR_TOO_LARGE;
    return plan_smoothing(user, m, worker, item, p);
}

static int cancel(void *user, const char *phase, double fraction)
{
    (void)user;
    CHECK(!strcmp(phase, "test") && fraction > 0 && fraction <= 1);
    return fraction > 0.3;
}

static void failures_leave_a_valid_mesh(void)
{
    delaunay_mesh m;
    delaunay_worker *w = NULL;
    delaunay_engine *engine;
    delaunay_host host;
    delaunay_speculation job;
    client c;
    double total;
    uint64_t hash;
    memset(&host, 0, sizeof host);
    memset(&job, 0, sizeof job);
    memset(&c, 0, sizeof c);
    CHECK(small_delaunay(&m, &w, NULL, 100));
    total = small_total(&m);
    hash = hash_mesh(&m);
    engine = c.engine = delaunay_engine_new(&m, &host);
    job.plan = plan_broken;
    job.num_items = m.num_tets - 1;
    CHECK(delaunay_speculate(engine, &job) == DELAUNAY_ERROR_INTERNAL && hash_mesh(&m) == hash);
    job.plan = plan_error;
    job.num_items = m.num_vertices - 5;
    CHECK(delaunay_speculate(engine, &job) == DELAUNAY_ERROR_INTERNAL && hash_mesh(&m) == hash);
    job.num_items = 0;
    CHECK(delaunay_speculate(engine, &job) == DELAUNAY_OK && hash_mesh(&m) == hash);
    job.plan = plan_smoothing;
    job.num_items = m.num_vertices - 5;
    job.user = &c;
    job.done = done;
    c.stop_after = 20;
    job.batch = 10;
    CHECK(delaunay_speculate(engine, &job) == DELAUNAY_STOPPED_BY_BUDGET && c.calls >= 20 &&
          c.calls < 40);
    CHECK(small_valid(&m) && small_total(&m) == total);
    delaunay_engine_free(engine);
    host.progress = cancel;
    engine = c.engine = delaunay_engine_new(&m, &host);
    c.stop_after = 0;
    job.phase = "test";
    CHECK(delaunay_speculate(engine, &job) == DELAUNAY_CANCELLED);
    CHECK(small_valid(&m) && small_total(&m) == total);
    delaunay_engine_free(engine);
    delaunay_worker_free(w);
    delaunay_mesh_free(&m);
}

static void out_of_memory_is_reported(void)
{
    small_allocator a;
    delaunay_host host;
    long k, ended = 0;
    delaunay_result result = DELAUNAY_ERROR_OUT_OF_MEMORY;
    memset(&host, 0, sizeof host);
    host.allocator.alloc = small_alloc;
    host.allocator.release = small_release;
    host.allocator.user = &a;
    a.outstanding = 0;
    for (k = 0; result != DELAUNAY_OK && k < 100000; k += 1 + k / 20) {
        delaunay_mesh m;
        delaunay_worker *w = NULL;
        uint64_t conflicts = 0;
        a.countdown = -1;
        small_state = 99;
        CHECK(small_delaunay(&m, &w, &host, 60));
        a.countdown = k;
        edit(&m, 1, &host, NULL, 40, &result, &conflicts);
        a.countdown = -1;
        CHECK(result == DELAUNAY_OK || result == DELAUNAY_ERROR_OUT_OF_MEMORY);
        CHECK(small_valid(&m) && small_total(&m) == 8e9);
        ended += result != DELAUNAY_OK;
        delaunay_worker_free(w);
        delaunay_mesh_free(&m);
        CHECK(a.outstanding == 0);
    }
    CHECK(result == DELAUNAY_OK && ended > 30);
}

/* Thousands of tetrahedra with a hull of ghosts; judged by the validator. */
static void a_delaunay_mesh_stays_valid(void)
{
    double *xyz = (double *)malloc(3 * 3000 * sizeof *xyz);
    uint64_t first = 0;
    int i, threads;
    for (threads = 1; threads <= 4; threads += 3) {
        delaunay_mesh m;
        delaunay_engine *engine;
        delaunay_host host;
        delaunay_speculation job;
        delaunay_report report;
        double total;
        memset(&m, 0, sizeof m);
        memset(&host, 0, sizeof host);
        host.num_threads = threads;
        host.clock = check_hasty_clock;
        small_state = 2024;
        for (i = 0; i < 9000; i++) xyz[i] = small_random(1000);
        CHECK(delaunay_tetrahedralize(&m, xyz, 3000, NULL, NULL) == DELAUNAY_OK);
        CHECK(delaunay_enable_marks(&m) == DELAUNAY_OK);
        CHECK(delaunay_link_vertices(&m) == DELAUNAY_OK);
        total = small_total(&m);
        engine = delaunay_engine_new(&m, &host);
        memset(&job, 0, sizeof job);
        job.plan = plan_reconnection;
        job.num_items = m.num_tets - 1;
        CHECK(delaunay_speculate(engine, &job) == DELAUNAY_OK && job.commits > 500);
        job.plan = plan_removal;
        job.num_items = 500;
        job.scatter = 1;
        CHECK(delaunay_speculate(engine, &job) == DELAUNAY_OK && job.commits > 100);
        CHECK(delaunay_validate(&m, DELAUNAY_VALIDATE_GEOMETRY, &report) == DELAUNAY_OK);
        CHECK(small_total(&m) == total);
        if (threads == 1) first = hash_mesh(&m);
        CHECK(hash_mesh(&m) == first);
        delaunay_engine_free(engine);
        delaunay_mesh_free(&m);
    }
    free(xyz);
}

/* A loop that took longer than the work in it is followed by ones alone. */
static void a_crew_stays_away_when_it_does_not_help(void)
{
    delaunay_host host;
    delaunay_crew crew;
    double start;
    memset(&host, 0, sizeof host);
    memset(&crew, 0, sizeof crew);
    host.num_threads = 3;
    crew.host = &host;
    CHECK(delaunay_crew_begin(&crew, 0) == 1);
    delaunay_crew_end(&crew, 1e-9);
    CHECK(crew.alone_until == 0);
    CHECK(delaunay_crew_begin(&crew, 1) == delaunay_threads(&host));
    start = delaunay_seconds(&host);
    while (delaunay_seconds(&host) - start < 1e-3) {}
    delaunay_crew_end(&crew, 1e9);
    CHECK(crew.alone_until == 0);
    delaunay_crew_end(&crew, 0); /* no such clock */
    CHECK(crew.alone_until == 0);
    delaunay_crew_end(&crew, 1e-9);
    CHECK(crew.alone_until > start || delaunay_threads(&host) == 1);
    crew.alone_until = start + 1e6;
    CHECK(delaunay_crew_begin(&crew, 1) == 1);
    delaunay_crew_end(&crew, 1e-9);
    host.clock = check_hasty_clock;
    crew.alone_until = 0;
    CHECK(delaunay_crew_begin(&crew, 1) == delaunay_threads(&host));
    delaunay_crew_end(&crew, 1e-9);
    CHECK(crew.alone_until == 0);
    start = delaunay_cpu_seconds();
    CHECK(start >= 0 && delaunay_cpu_seconds() >= start);
}

/* -- items that come up while others are done */

typedef struct growing {
    delaunay_speculation job;
    size_t done;
    double fraction;
} growing;

static int plan_nothing(void *user, const delaunay_mesh *m, delaunay_worker *worker, size_t item,
                        delaunay_plan *p)
{
    (void)user, (void)m, (void)worker, (void)item, (void)p;
    return DELAUNAY_PLAN_NOTHING;
}

static int raise_items(void *user, delaunay_mesh *m, delaunay_worker *worker, size_t item,
                       const delaunay_plan *p)
{
    growing *g = (growing *)user;
    (void)m, (void)worker, (void)p;
    CHECK(item == g->done);
    g->done++;
    if (item == 0) g->job.num_items = 5000;
    if (item == 4000) g->job.num_items = 5001;
    return 0;
}

static int note_fraction(void *user, const char *phase, double fraction)
{
    (void)phase;
    ((growing *)user)->fraction = fraction;
    return 0;
}

static void items_may_be_added_by_done(void)
{
    static const double xyz[15] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 1};
    delaunay_mesh m;
    delaunay_host host;
    delaunay_engine *engine;
    growing g;
    memset(&m, 0, sizeof m);
    memset(&g, 0, sizeof g);
    memset(&host, 0, sizeof host);
    host.progress = note_fraction;
    host.user = &g;
    CHECK(delaunay_tetrahedralize(&m, xyz, 5, NULL, NULL) == DELAUNAY_OK);
    engine = delaunay_engine_new(&m, &host);
    CHECK(engine != NULL);
    if (engine) {
        g.job.num_items = 1;
        g.job.plan = plan_nothing;
        g.job.done = raise_items;
        g.job.user = &g;
        g.job.from = g.job.to = 0.5;
        CHECK(delaunay_speculate(engine, &g.job) == DELAUNAY_OK);
        CHECK(g.done == 5001 && g.job.plans == 5001 && g.fraction == 0.5);
    }
    delaunay_engine_free(engine);
    delaunay_mesh_free(&m);
}

/* -- new vertices of a mesh with weights */

static void *alloc_dirty(void *user, size_t size)
{
    void *block = malloc(size);
    (void)user;
    if (block) memset(block, 0x41, size);
    return block;
}

static void free_dirty(void *user, void *block)
{
    (void)user;
    free(block);
}

static int plan_first(void *user, const delaunay_mesh *m, delaunay_worker *worker, size_t item,
                      delaunay_plan *p)
{
    static const double x[3] = {.2, .2, .2};
    const uint32_t *v = m->tets[1].v, n = DELAUNAY_PLAN_VERTEX(0);
    (void)user, (void)worker, (void)item;
    delaunay_plan_vertex(p, x);
    delaunay_plan_remove(p, 1);
    delaunay_plan_add(p, n, v[1], v[2], v[3]);
    delaunay_plan_add(p, v[0], n, v[2], v[3]);
    delaunay_plan_add(p, v[0], v[1], n, v[3]);
    return delaunay_plan_add(p, v[0], v[1], v[2], n);
}

static void new_vertices_have_no_weight(void)
{
    static const double xyz[18] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0},
                        weights[6] = {0, 0, 0, 0, 0, 0};
    delaunay_mesh m;
    delaunay_points points;
    delaunay_options options;
    delaunay_speculation job;
    delaunay_engine *engine;
    memset(&m, 0, sizeof m);
    memset(&points, 0, sizeof points);
    memset(&options, 0, sizeof options);
    memset(&job, 0, sizeof job);
    points.xyz = xyz;
    points.count = 6;
    points.weights = weights;
    options.host.allocator.alloc = alloc_dirty;
    options.host.allocator.release = free_dirty;
    CHECK(delaunay_tetrahedralize_points(&m, &points, &options, NULL) == DELAUNAY_OK);
    engine = delaunay_engine_new(&m, NULL);
    job.num_items = 1;
    job.plan = plan_first;
    CHECK(engine && delaunay_speculate(engine, &job) == DELAUNAY_OK && job.commits == 1);
    CHECK(m.num_vertices == 6 && m.weight && m.weight[5] == 0);
    delaunay_engine_free(engine);
    delaunay_mesh_free(&m);
}

int main(void)
{
    threads_do_not_matter();
#ifdef _OPENMP
    an_engine_keeps_its_threads();
#endif
    a_crew_stays_away_when_it_does_not_help();
    a_delaunay_mesh_stays_valid();
    stale_plans_are_made_again();
    what_a_plan_reads_counts();
    failures_leave_a_valid_mesh();
    out_of_memory_is_reported();
    items_may_be_added_by_done();
    new_vertices_have_no_weight();
    return check_report();
}
