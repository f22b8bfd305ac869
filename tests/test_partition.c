/* Engine (a) of delaunay.h: insertion and other edits in parallel, in sections of a space-filling
 * curve. For any number of threads the triangulation is the same; where it is unique, also for any
 * number of sections. */
#ifndef LINKED
#  define DELAUNAY_IMPLEMENTATION
#endif
#include "../delaunay.h"
#include "check.h"
#include <limits.h>
#ifdef _OPENMP
#  include <omp.h>
#endif
#include "small_mesh.h"

enum {
    POINTS = 24000,
    FIRST = 3000, /* of them are in the mesh before the run */
    WORKERS = 3
};

static void make_points(double *xyz, uint32_t count, uint32_t units)
{
    uint32_t i;
    small_state = 20201;
    for (i = 0; i < 3 * count; i++) xyz[i] = small_random(units);
}

/* The first points triangulated, the others added as vertices; these are the items. The host is not
 * asked whether to go on. */
static int start(delaunay_mesh *m, const delaunay_host *host, const double *xyz, uint32_t count,
                 uint32_t *items)
{
    delaunay_options options;
    uint32_t i;
    memset(m, 0, sizeof *m);
    memset(&options, 0, sizeof options);
    if (host) options.host = *host;
    options.host.progress = NULL;
    if (delaunay_tetrahedralize(m, xyz, FIRST, &options, NULL) != DELAUNAY_OK) return 0;
    for (i = FIRST; i < count; i++) {
        items[i - FIRST] = delaunay_add_vertex(m, xyz + 3 * (size_t)i, i);
        if (!items[i - FIRST]) return 0;
    }
    return 1;
}

static uint64_t mixed(uint64_t x)
{
    x = (x ^ x >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
    x = (x ^ x >> 27) * UINT64_C(0x94d049bb133111eb);
    return x ^ x >> 31;
}

/* Of the set of real tetrahedra, by the ids of their vertices. */
static uint64_t hash_set(const delaunay_mesh *m)
{
    uint64_t sum = 0;
    delaunay_handle t;
    int k;
    for (t = 1; t < m->num_tets; t++) {
        uint64_t a = 0, b = 0;
        if (delaunay_is_deleted(m, t) || delaunay_is_ghost(m, t)) continue;
        for (k = 0; k < 4; k++) {
            uint64_t x = mixed(m->vertex_id[m->tets[t].v[k]] + UINT64_C(1));
            a += x;
            b += x * x;
        }
        sum += mixed(a ^ mixed(b));
    }
    return sum;
}

/* Everything that an edit of these tests wants. */
typedef struct client {
    delaunay_mesh *mesh;
    double nearest2;   /* for sparse() */
    uint32_t error_at; /* for failing() */
    int error;
    size_t inserted[WORKERS][8]; /* for counting(), by worker: [0], the rest keeps them apart */
} client;

/* Which side of facet i a point is on; negative: within. */
static int side(const delaunay_mesh *m, delaunay_handle t, int i, const double *x)
{
    const uint32_t *v = m->tets[t].v;
    const uint8_t *o = delaunay_facet_order(i);
    return delaunay_orient3d(m->vertices[v[o[0]]].x, m->vertices[v[o[1]]].x, m->vertices[v[o[2]]].x,
                             x);
}

/* The section's tetrahedron that contains a point of the hull, or a ghost outside; 0: it, or the
 * way to it, is not the section's. */
static delaunay_handle find(const delaunay_mesh *m, const delaunay_section *section,
                            const double *x)
{
    delaunay_handle t = delaunay_section_hint(section);
    int step, i, k;
    if (t && delaunay_is_ghost(m, t)) t = m->tets[t].n[3] / 4;
    for (step = 0; step < 5000; step++) {
        if (!t || !delaunay_section_owns_tet(section, t)) return 0;
        if (delaunay_is_ghost(m, t)) return t;
        for (i = 0; i < 4; i++) { /* another one first each time: no circles */
            k = (i + step) % 4;
            if (side(m, t, k, x) > 0) break;
        }
        if (i == 4) return t;
        t = m->tets[t].n[k] / 4;
    }
    return 0;
}

/* Inserts what is not near a corner of the tetrahedron that it is in: the result depends on the
 * order. */
static int sparse(void *user, delaunay_section *section, uint32_t vertex)
{
    const client *c = (const client *)user;
    const delaunay_mesh *m = c->mesh;
    const double *x = m->vertices[vertex].x, *y;
    delaunay_handle t = find(m, section, x);
    int i;
    if (!t) return DELAUNAY_ITEM_CONFLICT;
    delaunay_section_set_hint(section, t);
    for (i = 0; i < 4; i++) /* a section's tetrahedron: all its vertices are */
        if (m->tets[t].v[i] != DELAUNAY_GHOST && !delaunay_section_owns(section, m->tets[t].v[i]))
            return DELAUNAY_ERROR_INTERNAL;
    for (i = 0; i < 4 && !delaunay_is_ghost(m, t); i++) {
        y = m->vertices[m->tets[t].v[i]].x;
        if ((x[0] - y[0]) * (x[0] - y[0]) + (x[1] - y[1]) * (x[1] - y[1]) +
                (x[2] - y[2]) * (x[2] - y[2]) <
            c->nearest2)
            return DELAUNAY_ITEM_NOTHING;
    }
    return delaunay_section_insert(section, vertex);
}

/* Four tetrahedra in place of the one that a vertex is in, by hand; five slots are taken for them,
 * and two given back. */
static int split(void *user, delaunay_section *section, uint32_t vertex)
{
    delaunay_mesh *m = ((client *)user)->mesh;
    delaunay_handle t = find(m, section, m->vertices[vertex].x), slots[6];
    delaunay_tet old, *made[4];
    int i, j, answer;
    if (!t) return DELAUNAY_ITEM_CONFLICT;
    delaunay_section_set_hint(section, t);
    if (delaunay_is_ghost(m, t) || !delaunay_section_owns(section, vertex))
        return DELAUNAY_ITEM_NOTHING;
    for (i = 0; i < 4; i++) /* on a facet */
        if (side(m, t, i, m->vertices[vertex].x) == 0) return DELAUNAY_ITEM_NOTHING;
    answer = delaunay_section_take(section, 5, slots + 1);
    if (answer != DELAUNAY_ITEM_DONE) return answer;
    answer = delaunay_section_give(section, slots + 4, 2);
    if (answer != DELAUNAY_ITEM_DONE) return answer;
    slots[0] = t;
    old = m->tets[t];
    for (i = 0; i < 4; i++) {
        const uint8_t *o = delaunay_facet_order(i);
        made[i] = m->tets + slots[i];
        made[i]->v[0] = old.v[o[0]];
        made[i]->v[1] = old.v[o[2]];
        made[i]->v[2] = old.v[o[1]];
        made[i]->v[3] = vertex;
        made[i]->n[3] = old.n[i];
        m->tets[old.n[i] / 4].n[old.n[i] % 4] = 4 * slots[i] + 3;
    }
    for (i = 0; i < 4; i++)
        for (j = 0; j < 4; j++)
            if (i != j)
                made[i]->n[delaunay_local_index(made[i], old.v[j])] =
                    4 * slots[j] + (delaunay_handle)delaunay_local_index(made[j], old.v[i]);
    return DELAUNAY_ITEM_DONE;
}

/* Inserts until a certain vertex. */
static int failing(void *user, delaunay_section *section, uint32_t vertex)
{
    const client *c = (const client *)user;
    if (vertex == c->error_at) return c->error;
    return delaunay_section_insert(section, vertex);
}

/* Counts by worker what is inserted. */
static int counting(void *user, delaunay_section *section, uint32_t vertex)
{
    client *c = (client *)user;
    int worker = delaunay_section_worker(section), answer;
    if (worker < 0 || worker >= WORKERS) return DELAUNAY_ERROR_INTERNAL;
    answer = delaunay_section_insert(section, vertex);
    if (answer == DELAUNAY_ITEM_DONE) c->inserted[worker][0]++;
    return answer;
}

static int never(void *user, delaunay_section *section, uint32_t vertex)
{
    (void)user;
    (void)section;
    (void)vertex;
    return DELAUNAY_ITEM_CONFLICT;
}

static void set_up(delaunay_host *host, int num_threads, delaunay_partition *job, int num_sections)
{
    memset(host, 0, sizeof *host);
    memset(job, 0, sizeof *job);
    host->num_threads = num_threads;
    job->num_sections = num_sections;
}

/* A run over all that is to come into a mesh that starts anew, which stays valid at this level. */
static delaunay_result run(delaunay_mesh *m, const delaunay_host *host, const double *xyz,
                           uint32_t count, delaunay_partition *job, int level)
{
    uint32_t *items = (uint32_t *)malloc(count * sizeof *items);
    delaunay_result result = DELAUNAY_ERROR_OUT_OF_MEMORY;
    if (job->user) ((client *)job->user)->mesh = m;
    if (start(m, host, xyz, count, items)) {
        job->vertices = items;
        job->num_vertices = count - FIRST;
        result = delaunay_partition_run(m, job, host);
        CHECK(delaunay_validate(m, level, NULL) == DELAUNAY_OK);
    }
    free(items);
    return result;
}

static void the_triangulation_is_unique(const double *xyz)
{
    static const int sections[] = {0, 1, 2, 5, 13, 1000}, threads[] = {1, 2, 3, 8};
    delaunay_mesh m = {0};
    uint64_t at_once;
    int i, k;
    CHECK(delaunay_tetrahedralize(&m, xyz, POINTS, NULL, NULL) == DELAUNAY_OK);
    at_once = hash_set(&m);
    delaunay_mesh_free(&m);
    for (i = 0; i < 6; i++) {
        uint64_t attempts = 0, conflicts = 0;
        for (k = 0; k < 4; k++) {
            delaunay_host host;
            delaunay_partition job;
            set_up(&host, threads[k], &job, sections[i]);
            CHECK(run(&m, &host, xyz, POINTS, &job, DELAUNAY_VALIDATE_DELAUNAY) == DELAUNAY_OK);
            CHECK(hash_set(&m) == at_once);
            if (sections[i] == 1) CHECK(job.attempts == 0 && job.conflicts == 0);
            if (sections[i] > 1) CHECK(job.attempts > 0 && job.conflicts > 0);
            if (sections[i] > 1 && k) CHECK(job.attempts == attempts && job.conflicts == conflicts);
            attempts = job.attempts;
            conflicts = job.conflicts;
            delaunay_mesh_free(&m);
        }
    }
}

/* Edits whose result depends on their order; some items are not inserted, some are there twice. */
static void threads_do_not_matter(double *xyz)
{
    static const int threads[] = {1, 2, 3, 8};
    static int (*const edits[2])(void *, delaunay_section *, uint32_t) = {sparse, split};
    uint64_t hash = 0;
    int e, k;
    for (e = 0; e < 2; e++)
        for (k = 0; k < 4; k++) {
            delaunay_mesh m;
            delaunay_host host;
            delaunay_partition job;
            client c;
            double total;
            set_up(&host, threads[k], &job, 8);
            memset(&c, 0, sizeof c);
            c.nearest2 = 30 * 30;
            job.edit = edits[e];
            job.user = &c;
            CHECK(run(&m, &host, xyz, POINTS, &job,
                      e ? DELAUNAY_VALIDATE_GEOMETRY : DELAUNAY_VALIDATE_DELAUNAY) == DELAUNAY_OK);
            CHECK(job.attempts > 0 && job.conflicts > 0);
            CHECK(delaunay_count_tets(&m) > 10 * FIRST);
            if (k == 0) hash = hash_set(&m);
            CHECK(hash_set(&m) == hash);
            if (e == 1) { /* splits keep the hull: integers, exactly */
                total = small_total(&m);
                delaunay_mesh_free(&m);
                CHECK(delaunay_tetrahedralize(&m, xyz, FIRST, NULL, NULL) == DELAUNAY_OK);
                CHECK(small_total(&m) == total);
            }
            delaunay_mesh_free(&m);
        }
}

static int cancel(void *user, const char *phase, double fraction)
{
    (void)user;
    CHECK(!strcmp(phase, "test") && fraction >= 0 && fraction <= 1);
    return fraction > 0.2;
}

static void failures_leave_a_valid_mesh(const double *xyz)
{
    static const int sections[] = {1, 8};
    int i;
    for (i = 0; i < 2; i++) {
        delaunay_mesh m;
        delaunay_host host;
        delaunay_partition job;
        client c;
        set_up(&host, 3, &job, sections[i]);
        memset(&c, 0, sizeof c);
        job.user = &c;
        job.edit = failing;
        c.error_at = POINTS / 2;
        c.error = DELAUNAY_ERROR_INTERNAL;
        CHECK(run(&m, &host, xyz, POINTS, &job, DELAUNAY_VALIDATE_DELAUNAY) ==
              DELAUNAY_ERROR_INTERNAL);
        delaunay_mesh_free(&m);
        c.error = DELAUNAY_ITEM_NOTHING; /* which is no error */
        CHECK(run(&m, &host, xyz, POINTS, &job, DELAUNAY_VALIDATE_DELAUNAY) == DELAUNAY_OK);
        delaunay_mesh_free(&m);
        job.edit = never; /* ends nevertheless */
        CHECK(run(&m, &host, xyz, POINTS, &job, DELAUNAY_VALIDATE_DELAUNAY) ==
              DELAUNAY_ERROR_INTERNAL);
        CHECK(job.attempts < 20);
        delaunay_mesh_free(&m);
        /* no items at all */
        CHECK(run(&m, NULL, xyz, FIRST, &job, DELAUNAY_VALIDATE_DELAUNAY) == DELAUNAY_OK);
        delaunay_mesh_free(&m);
    }
}

static void fewer_than_no_sections_are_refused(const double *xyz)
{
    delaunay_mesh m;
    delaunay_host host;
    delaunay_partition job;
    set_up(&host, 2, &job, -1);
    CHECK(run(&m, &host, xyz, POINTS, &job, DELAUNAY_VALIDATE_DELAUNAY) ==
          DELAUNAY_ERROR_INVALID_ARGUMENT);
    CHECK(job.attempts == 0 && job.conflicts == 0);
    delaunay_mesh_free(&m);
}

/* The host ends a run; it is asked by the calling thread alone. */
static void the_host_may_end_it(const double *xyz)
{
    static const int sections[] = {1, 4};
    int i;
    for (i = 0; i < 2; i++) {
        delaunay_mesh m;
        delaunay_host host;
        delaunay_partition job;
        set_up(&host, 2, &job, sections[i]);
        host.progress = cancel;
        job.phase = "test";
        CHECK(run(&m, &host, xyz, POINTS, &job, DELAUNAY_VALIDATE_DELAUNAY) == DELAUNAY_CANCELLED);
        delaunay_mesh_free(&m);
    }
}

/* What an edit keeps for each worker, no other thread writes at the same time. */
static void workers_are_numbered(const double *xyz)
{
    static const int sections[] = {1, 12};
    int i;
    for (i = 0; i < 2; i++) {
        delaunay_mesh m;
        delaunay_host host;
        delaunay_partition job;
        client c;
        set_up(&host, WORKERS, &job, sections[i]);
        memset(&c, 0, sizeof c);
        job.edit = counting;
        job.user = &c;
        CHECK(run(&m, &host, xyz, POINTS, &job, DELAUNAY_VALIDATE_DELAUNAY) == DELAUNAY_OK);
        CHECK(c.inserted[0][0] + c.inserted[1][0] + c.inserted[2][0] == POINTS - FIRST);
        if (sections[i] == 1) CHECK(c.inserted[0][0] == POINTS - FIRST);
        delaunay_mesh_free(&m);
    }
}

/* Sections without an item of their own take no memory. */
static void sections_beyond_the_items_are_free(const double *xyz)
{
    delaunay_mesh m;
    delaunay_host host;
    delaunay_partition job;
    set_up(&host, 2, &job, INT_MAX);
    CHECK(run(&m, &host, xyz, FIRST + 50, &job, DELAUNAY_VALIDATE_DELAUNAY) == DELAUNAY_OK);
    CHECK(m.memory.peak_bytes < 64 << 20);
    delaunay_mesh_free(&m);
    CHECK(delaunay_count_tets(NULL) == 0);
}

static void out_of_memory_is_reported(const double *xyz)
{
    enum { COUNT = FIRST + 4000 };
    uint32_t *items = (uint32_t *)malloc(COUNT * sizeof *items);
    small_allocator a;
    delaunay_host host;
    delaunay_result result = DELAUNAY_ERROR_OUT_OF_MEMORY;
    long k, ended = 0;
    memset(&host, 0, sizeof host);
    memset(&a, 0, sizeof a);
    host.allocator.alloc = small_alloc;
    host.allocator.release = small_release;
    host.allocator.user = &a;
    host.num_threads = 1; /* the allocator counts without locks */
    for (k = 0; result != DELAUNAY_OK && k < 1000; k++) {
        delaunay_mesh m;
        delaunay_partition job;
        memset(&job, 0, sizeof job);
        job.num_sections = 2;
        a.countdown = -1;
        CHECK(start(&m, &host, xyz, COUNT, items));
        job.vertices = items;
        job.num_vertices = COUNT - FIRST;
        a.countdown = k;
        result = delaunay_partition_run(&m, &job, &host);
        a.countdown = -1;
        CHECK(result == DELAUNAY_OK || result == DELAUNAY_ERROR_OUT_OF_MEMORY);
        CHECK(delaunay_validate(&m, DELAUNAY_VALIDATE_DELAUNAY, NULL) == DELAUNAY_OK);
        ended += result != DELAUNAY_OK;
        delaunay_mesh_free(&m);
        CHECK(a.outstanding == 0);
    }
    CHECK(result == DELAUNAY_OK && ended > 5);
    free(items);
}

#ifdef _OPENMP
/* Runs within a parallel region of the host's, each on a mesh of its own. */
static void hosts_run_side_by_side(const double *xyz)
{
    uint64_t hash[6] = {0};
    int i;
#  pragma omp parallel for num_threads(3) schedule(dynamic, 1)
    for (i = 0; i < 6; i++) {
        uint32_t *items = (uint32_t *)malloc(POINTS * sizeof *items);
        delaunay_mesh m;
        delaunay_host host;
        delaunay_partition job;
        set_up(&host, 2, &job, i); /* the result is unique */
        if (start(&m, &host, xyz, POINTS, items)) {
            job.vertices = items;
            job.num_vertices = POINTS - FIRST;
            if (delaunay_partition_run(&m, &job, &host) == DELAUNAY_OK) hash[i] = hash_set(&m);
        }
        delaunay_mesh_free(&m);
        free(items);
    }
    for (i = 0; i < 6; i++) CHECK(hash[i] != 0 && hash[i] == hash[0]);
}
#endif

int main(void)
{
    double *xyz = (double *)malloc(3 * POINTS * sizeof *xyz);
    make_points(xyz, POINTS, 1u << 30);
    the_triangulation_is_unique(xyz);
    failures_leave_a_valid_mesh(xyz);
    fewer_than_no_sections_are_refused(xyz);
    the_host_may_end_it(xyz);
    workers_are_numbered(xyz);
    sections_beyond_the_items_are_free(xyz);
    out_of_memory_is_reported(xyz);
#ifdef _OPENMP
    hosts_run_side_by_side(xyz);
#endif
    make_points(xyz, POINTS, 1000); /* some twice */
    threads_do_not_matter(xyz);
    free(xyz);
    return check_report();
}
