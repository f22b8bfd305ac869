/* Insertion into and removal from a finished triangulation, compared with the triangulation of the
 * same points made at once. */
#ifndef LINKED
#  define DELAUNAY_IMPLEMENTATION
#endif
#include "../delaunay.h"
#include "check.h"
#include <math.h>
#include <stdlib.h>

static uint64_t random_state = 7;
static uint32_t random_u32(void)
{
    random_state = random_state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (uint32_t)(random_state >> 33);
}

enum { UNIFORM, GRID, DECIMAL, SPHERE, PRISM, PLANE_AND_FEW, NUM_KINDS };

static void make_point(int kind, double *x)
{
    static const double circle[12][2] = {{5, 0},  {4, 3},   {3, 4},   {0, 5},  {-3, 4}, {-4, 3},
                                         {-5, 0}, {-4, -3}, {-3, -4}, {0, -5}, {3, -4}, {4, -3}};
    uint32_t i = random_u32() % 12;
    int k;
    for (k = 0; k < 3; k++) x[k] = random_u32() / 2147483648.0;
    if (kind == GRID || kind == DECIMAL || kind == PLANE_AND_FEW)
        for (k = 0; k < 3; k++) x[k] = random_u32() % 5;
    if (kind == DECIMAL)
        for (k = 0; k < 3; k++) x[k] = x[k] * 0.1 + 0.3;
    if (kind == PLANE_AND_FEW && random_u32() % 8) x[2] = 0;
    if (kind == SPHERE) { /* integers with x^2 + y^2 + z^2 = 81 */
        static const int on[6][3] = {{9, 0, 0}, {8, 4, 1}, {7, 4, 4},
                                     {6, 6, 3}, {4, 8, 1}, {4, 7, 4}};
        const int *p = on[random_u32() % 6];
        uint32_t turn = random_u32();
        for (k = 0; k < 3; k++)
            x[k] = (turn >> (k + 8) & 1 ? -1 : 1) * p[((uint32_t)k + turn % 3) % 3];
    }
    if (kind == PRISM) x[0] = circle[i][0], x[1] = circle[i][1], x[2] = random_u32() % 3;
}

static int compare_quads(const void *a, const void *b) { return memcmp(a, b, 16); }

/* Ghosts too, as sorted quadruples of ids; id[v]: of a vertex of the mesh, 0: none. */
static uint32_t *set_of_tets(const delaunay_mesh *mesh, const uint32_t *id, size_t *count)
{
    uint32_t *tets = (uint32_t *)malloc((size_t)mesh->num_tets * 16), u;
    size_t n = 0;
    delaunay_handle t;
    int j, k;
    for (t = 1; t < mesh->num_tets; t++) {
        uint32_t *v = tets + 4 * n;
        if (delaunay_is_deleted(mesh, t)) continue;
        for (j = 0; j < 4; j++) v[j] = mesh->tets[t].v[j] ? id[mesh->tets[t].v[j]] : 0;
        for (j = 0; j < 4; j++)
            for (k = j + 1; k < 4; k++)
                if (v[k] < v[j]) u = v[j], v[j] = v[k], v[k] = u;
        n++;
    }
    qsort(tets, n, 16, compare_quads);
    *count = n;
    return tets;
}

/* The mesh is the triangulation of those of its vertices that are in it. */
static int as_made_at_once(const delaunay_mesh *mesh)
{
    delaunay_mesh fresh = {0};
    uint32_t n = mesh->num_vertices, v, m = 0, *a, *b;
    uint32_t *id = (uint32_t *)malloc(n * sizeof *id), *back = (uint32_t *)malloc(n * sizeof *id);
    double *xyz = (double *)malloc(3 * n * sizeof *xyz);
    size_t na, nb;
    int same;
    for (v = 1; v < n; v++) {
        id[v] = 0;
        if (!mesh->vertex_tet[v]) continue;
        memcpy(xyz + 3 * m, mesh->vertices[v].x, 3 * sizeof *xyz);
        id[v] = ++m;
    }
    CHECK(delaunay_tetrahedralize(&fresh, xyz, m, NULL, NULL) == DELAUNAY_OK);
    for (v = 1; v < fresh.num_vertices; v++) back[v] = fresh.vertex_id[v] + 1;
    a = set_of_tets(mesh, id, &na);
    b = set_of_tets(&fresh, back, &nb);
    same = na == nb && memcmp(a, b, 16 * na) == 0;
    delaunay_mesh_free(&fresh);
    free(a), free(b), free(id), free(back), free(xyz);
    return same;
}

/* Points come and go at random; ties everywhere. */
static void coming_and_going(int kind)
{
    delaunay_mesh mesh = {0};
    delaunay_editor *editor;
    double xyz[3 * 40];
    uint32_t i, v, removed = 0, flat = 0;
    for (i = 0; i < 40; i++) make_point(kind, xyz + 3 * i);
    CHECK(delaunay_tetrahedralize(&mesh, xyz, 40, NULL, NULL) == DELAUNAY_OK);
    editor = delaunay_editor_new(&mesh);
    CHECK(editor != NULL);
    for (i = 0; i < 200; i++) {
        if (random_u32() % 5 < 2) {
            double x[3];
            uint32_t before = mesh.num_vertices, w;
            make_point(kind, x);
            CHECK(delaunay_editor_insert(editor, x, 1000 + i, random_u32() % mesh.num_tets, &v) ==
                  DELAUNAY_OK);
            CHECK(v && mesh.vertex_tet[v] && memcmp(mesh.vertices[v].x, x, sizeof x) == 0);
            CHECK(delaunay_editor_insert(editor, x, 0, 0, &w) == DELAUNAY_OK && w == v);
            CHECK(mesh.num_vertices == before + (v == before));
            CHECK(delaunay_editor_insert_vertex(editor, v, 0) == DELAUNAY_ERROR_INVALID_ARGUMENT);
        } else {
            delaunay_result result;
            v = 1 + random_u32() % (mesh.num_vertices - 1);
            if (!mesh.vertex_tet[v]) {
                CHECK(delaunay_editor_remove(editor, v) == DELAUNAY_ERROR_INVALID_ARGUMENT);
                if (i % 2) continue;
                result = delaunay_editor_insert_vertex(editor, v, 0);
                CHECK((result == DELAUNAY_OK) == (mesh.vertex_tet[v] != 0));
            } else {
                result = delaunay_editor_remove(editor, v);
                CHECK(result == DELAUNAY_OK || result == DELAUNAY_ERROR_DIMENSION);
                CHECK((result == DELAUNAY_OK) == (mesh.vertex_tet[v] == 0));
                removed += result == DELAUNAY_OK;
                flat += result == DELAUNAY_ERROR_DIMENSION;
            }
        }
        CHECK(delaunay_validate(&mesh, DELAUNAY_VALIDATE_DELAUNAY, NULL) == DELAUNAY_OK);
        if (i % 4 == 0) CHECK(as_made_at_once(&mesh));
    }
    for (v = 1; v < mesh.num_vertices; v++) { /* until four are left */
        delaunay_result result;
        if (!mesh.vertex_tet[v]) continue;
        result = delaunay_editor_remove(editor, v);
        CHECK(result == DELAUNAY_OK || result == DELAUNAY_ERROR_DIMENSION);
        removed += result == DELAUNAY_OK;
        flat += result == DELAUNAY_ERROR_DIMENSION;
        CHECK(delaunay_validate(&mesh, DELAUNAY_VALIDATE_DELAUNAY, NULL) == DELAUNAY_OK);
    }
    CHECK(as_made_at_once(&mesh));
    CHECK(removed > 60 && flat > 0);
    delaunay_editor_free(editor);
    CHECK(delaunay_canonicalize(&mesh, NULL) == DELAUNAY_OK);
    CHECK(delaunay_validate(&mesh, DELAUNAY_VALIDATE_DELAUNAY, NULL) == DELAUNAY_OK);
    delaunay_mesh_free(&mesh);
}

/* Byte for byte: what is put in and taken out again leaves no trace after renumbering. */
static void removal_restores_the_bytes(void)
{
    delaunay_mesh mesh = {0};
    delaunay_editor *editor;
    double *xyz = (double *)malloc(3 * 2000 * sizeof *xyz);
    delaunay_tet *copy;
    uint32_t i, v, added[300], n;
    delaunay_handle num;
    for (i = 0; i < 2000; i++) make_point(i % 2 ? GRID : UNIFORM, xyz + 3 * i);
    CHECK(delaunay_tetrahedralize(&mesh, xyz, 2000, NULL, NULL) == DELAUNAY_OK);
    num = mesh.num_tets;
    copy = (delaunay_tet *)malloc(num * sizeof *copy);
    memcpy(copy, mesh.tets, num * sizeof *copy);
    n = mesh.num_vertices;
    editor = delaunay_editor_new(&mesh);
    for (i = 0; i < 300; i++) {
        double x[3];
        make_point(UNIFORM, x);
        if (i % 3 == 0) x[0] = 4 * x[0] - 1;
        CHECK(delaunay_editor_insert(editor, x, 5000 + i, 0, &added[i]) == DELAUNAY_OK);
    }
    for (i = 300; i-- > 1;) {
        uint32_t j = random_u32() % (i + 1);
        v = added[i];
        added[i] = added[j];
        added[j] = v;
    }
    for (i = 0; i < 300; i++) CHECK(delaunay_editor_remove(editor, added[i]) == DELAUNAY_OK);
    for (v = n; v < mesh.num_vertices; v++) CHECK(mesh.vertex_tet[v] == 0);
    delaunay_editor_free(editor);
    CHECK(delaunay_canonicalize(&mesh, NULL) == DELAUNAY_OK);
    CHECK(mesh.num_tets == num && memcmp(copy, mesh.tets, num * sizeof *copy) == 0);
    free(copy);
    free(xyz);
    delaunay_mesh_free(&mesh);
}

static uint64_t hash_tets(const delaunay_mesh *m)
{
    uint64_t h = UINT64_C(0xcbf29ce484222325);
    const unsigned char *p = (const unsigned char *)m->tets;
    size_t i;
    for (i = 0; i < m->num_tets * sizeof *m->tets; i++) h = (h ^ p[i]) * UINT64_C(0x100000001b3);
    for (i = 0; i < m->num_points; i++) h = (h ^ m->vertex_of[i]) * UINT64_C(0x100000001b3);
    return h;
}

/* In several helpings, the same set as at once; the same bytes for any number of threads. */
static void many_at_once(int kind)
{
    enum { N = 9000 };
    static const size_t part[5] = {0, 10, 1500, 1600, N};
    static const int threads[4] = {1, 2, 3, 5};
    double *xyz = (double *)malloc(3 * N * sizeof *xyz);
    uint64_t hash = 0;
    size_t i, p;
    int k;
    for (i = 0; i < N; i++) make_point(kind, xyz + 3 * i);
    for (k = 0; k < 4; k++) {
        delaunay_mesh mesh = {0};
        delaunay_options options;
        delaunay_report report;
        memset(&options, 0, sizeof options);
        options.host.num_threads = threads[k];
        for (p = 0; p < 4; p++) {
            delaunay_result result =
                delaunay_insert(&mesh, xyz + 3 * part[p], part[p + 1] - part[p], &options, &report);
            CHECK(result == DELAUNAY_OK && report.num_points == part[p + 1]);
            CHECK(report.num_vertices == mesh.num_vertices - 1);
            CHECK(report.num_tets == delaunay_count_tets(&mesh));
        }
        CHECK(delaunay_insert(&mesh, xyz, 0, &options, &report) == DELAUNAY_OK);
        CHECK(delaunay_validate(&mesh, DELAUNAY_VALIDATE_DELAUNAY, NULL) == DELAUNAY_OK);
        for (i = 0; i < N; i++)
            CHECK(memcmp(mesh.vertices[mesh.vertex_of[i]].x, xyz + 3 * i, 24) == 0);
        if (k == 0) hash = hash_tets(&mesh);
        CHECK(hash == hash_tets(&mesh));
        CHECK(delaunay_link_vertices(&mesh) == DELAUNAY_OK);
        if (k == 3) CHECK(as_made_at_once(&mesh));
        delaunay_mesh_free(&mesh);
    }
    free(xyz);
}

typedef struct failing {
    long calls, fail_at, live;
} failing;
static void *failing_alloc(void *user, size_t size)
{
    failing *f = (failing *)user;
    if (++f->calls == f->fail_at) return NULL;
    f->live++;
    return malloc(size);
}
static void failing_release(void *user, void *block)
{
    ((failing *)user)->live--;
    free(block);
}

/* Whichever allocation fails, what is there is a triangulation. */
static void any_allocation_may_fail(void)
{
    long k, failed = 0;
    for (k = 1;; k++) {
        failing f = {0, 0, 0};
        delaunay_mesh mesh = {0};
        delaunay_options options;
        delaunay_editor *editor;
        double xyz[3 * 60];
        uint32_t i, v;
        long after;
        int failures = 0;
        memset(&options, 0, sizeof options);
        options.host.num_threads = 1;
        options.host.allocator.alloc = failing_alloc;
        options.host.allocator.release = failing_release;
        options.host.allocator.user = &f;
        random_state = 99;
        for (i = 0; i < 60; i++) make_point(SPHERE, xyz + 3 * i);
        CHECK(delaunay_tetrahedralize(&mesh, xyz, 30, &options, NULL) == DELAUNAY_OK);
        f.fail_at = f.calls + k;
        failures += delaunay_insert(&mesh, xyz + 90, 30, &options, NULL) != DELAUNAY_OK;
        CHECK(delaunay_validate(&mesh, DELAUNAY_VALIDATE_DELAUNAY, NULL) == DELAUNAY_OK);
        editor = delaunay_editor_new(&mesh);
        failures += editor == NULL;
        for (i = 0; i < 30 && editor; i++) {
            double x[3];
            make_point(UNIFORM, x);
            failures += delaunay_editor_insert(editor, x, i, 0, &v) == DELAUNAY_ERROR_OUT_OF_MEMORY;
            failures += delaunay_editor_remove(editor, 1 + i % 20) == DELAUNAY_ERROR_OUT_OF_MEMORY;
            CHECK(delaunay_validate(&mesh, DELAUNAY_VALIDATE_DELAUNAY, NULL) == DELAUNAY_OK);
        }
        after = f.calls;
        delaunay_editor_free(editor);
        CHECK(delaunay_validate(&mesh, DELAUNAY_VALIDATE_DELAUNAY, NULL) == DELAUNAY_OK);
        delaunay_mesh_free(&mesh);
        CHECK(f.live == 0);
        if (f.fail_at > f.calls) break;
        CHECK(failures > 0 || f.fail_at > after);
        failed++;
    }
    CHECK(failed > 100);
}

/* After removals in the hull ghosts are still outside, and no other tetrahedron is. One kind has
 * whole sides in a plane. */
static void removal_keeps_ghosts_outside(int kind)
{
    enum { N = 200 };
    delaunay_mesh mesh = {0};
    double xyz[3 * N];
    delaunay_editor *editor;
    delaunay_handle t;
    int i, removed = 0;
    for (i = 0; i < N; i++) make_point(kind, xyz + 3 * i);
    CHECK(delaunay_tetrahedralize(&mesh, xyz, N, NULL, NULL) == DELAUNAY_OK);
    CHECK(delaunay_enable_marks(&mesh) == DELAUNAY_OK);
    for (t = 1; t < mesh.num_tets; t++) mesh.color[t] = delaunay_is_ghost(&mesh, t) ? 0 : 1 + t % 2;
    CHECK((editor = delaunay_editor_new(&mesh)) != NULL);
    for (i = 0; i < 60; i++) {
        uint32_t v = i % 3 ? 0 : 1 + random_u32() % (mesh.num_vertices - 1);
        for (t = 1 + random_u32() % (mesh.num_tets - 1); v == 0; t = t % (mesh.num_tets - 1) + 1)
            if (!delaunay_is_deleted(&mesh, t) && delaunay_is_ghost(&mesh, t))
                v = mesh.tets[t].v[i % 2];
        removed += delaunay_editor_remove(editor, v) == DELAUNAY_OK && i % 3;
        for (t = 1; t < mesh.num_tets; t++)
            if (!delaunay_is_deleted(&mesh, t))
                CHECK(delaunay_is_ghost(&mesh, t) == (mesh.color[t] == DELAUNAY_OUTSIDE));
    }
    CHECK(removed == 40);
    CHECK(delaunay_validate(&mesh, DELAUNAY_VALIDATE_DELAUNAY, NULL) == DELAUNAY_OK);
    delaunay_editor_free(editor);
    delaunay_mesh_free(&mesh);
}

static void what_is_refused(void)
{
    delaunay_mesh mesh = {0};
    double xyz[15] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0};
    delaunay_report report;
    delaunay_editor *editor;
    uint32_t v = 9;
    CHECK(delaunay_editor_new(&mesh) == NULL);
    CHECK(delaunay_insert(&mesh, xyz, 3, NULL, &report) == DELAUNAY_ERROR_DIMENSION);
    CHECK(delaunay_insert(&mesh, xyz, 4, NULL, &report) == DELAUNAY_OK);
    editor = delaunay_editor_new(&mesh);
    CHECK(delaunay_editor_remove(editor, 1) == DELAUNAY_ERROR_DIMENSION);
    CHECK(delaunay_editor_remove(editor, 0) == DELAUNAY_ERROR_INVALID_ARGUMENT);
    CHECK(delaunay_editor_remove(editor, 5) == DELAUNAY_ERROR_INVALID_ARGUMENT);
    xyz[13] = NAN;
    CHECK(delaunay_editor_insert(editor, xyz + 12, 4, 0, &v) == DELAUNAY_ERROR_NOT_FINITE);
    CHECK(v == 0 && mesh.num_vertices == 5);
    v = delaunay_add_vertex(&mesh, xyz + 12, 4);
    CHECK(delaunay_editor_insert_vertex(editor, v, 0) == DELAUNAY_ERROR_NOT_FINITE);
    CHECK(mesh.vertex_tet[v] == 0);
    CHECK(delaunay_validate(&mesh, DELAUNAY_VALIDATE_DELAUNAY, NULL) == DELAUNAY_OK);
    mesh.num_vertices--;
    delaunay_editor_free(editor);
    CHECK(delaunay_insert(&mesh, xyz + 12, 1, NULL, &report) == DELAUNAY_ERROR_NOT_FINITE);
    CHECK(report.num_ids == 1 && report.ids[0] == 4 && mesh.num_points == 4);
    CHECK(strstr(report.message, "point 4 at ") != NULL);
    CHECK(delaunay_enable_marks(&mesh) == DELAUNAY_OK);
    CHECK(delaunay_insert(&mesh, xyz, 1, NULL, &report) == DELAUNAY_ERROR_INVALID_ARGUMENT);
    delaunay_mesh_free(&mesh);
}

static int stop_at_call(void *user, const char *phase, double fraction)
{
    (void)phase;
    (void)fraction;
    return --*(int *)user == 0;
}

/* An insertion that was stopped, by the caller or for memory, and is then made once more. */
static void again_after_failure(int for_memory)
{
    enum { OLD = 100, COUNT = 20000 };
    delaunay_mesh mesh = {0};
    delaunay_options options = {0};
    delaunay_report report;
    delaunay_result result = DELAUNAY_OK;
    delaunay_worker *worker;
    double *xyz = (double *)malloc(COUNT * sizeof *xyz * 3);
    int i, stopped = 0, countdown;
    for (i = 0; i < COUNT; i++) make_point(UNIFORM, xyz + 3 * i);
    for (i = 1; i < 9; i++) {
        CHECK(delaunay_insert(&mesh, xyz, OLD, NULL, NULL) == DELAUNAY_OK);
        CHECK(delaunay_link_vertices(&mesh) == DELAUNAY_OK);
        countdown = i;
        options.host.progress = for_memory ? NULL : stop_at_call;
        options.host.user = &countdown;
        options.host.memory_limit_bytes = for_memory ? 1500000 + (size_t)i * 500000 : 0;
        result = delaunay_insert(&mesh, xyz + 3 * OLD, COUNT - OLD, &options, &report);
        stopped += result != DELAUNAY_OK;
        CHECK(delaunay_validate(&mesh, DELAUNAY_VALIDATE_DELAUNAY, NULL) == DELAUNAY_OK);
        mesh.memory.limit_bytes = 0;
        if (result != DELAUNAY_OK) { /* vertex_tet is right: what is nearest is found */
            worker = delaunay_worker_new(&mesh.memory);
            CHECK(delaunay_nearest(&mesh, worker, xyz, 0) == mesh.vertex_of[0]);
            delaunay_worker_free(worker);
        }
        CHECK(delaunay_insert(&mesh, xyz + 3 * OLD, COUNT - OLD, NULL, &report) == DELAUNAY_OK);
        CHECK(mesh.num_vertices == COUNT + 1);
        CHECK(as_made_at_once(&mesh));
        delaunay_mesh_free(&mesh);
    }
    CHECK(stopped > 3);
    free(xyz);
}

/* Other edits between the calls of an editor, those that number the slots anew among them. */
static void between_calls(int kind)
{
    delaunay_mesh mesh = {0};
    delaunay_editor *editor;
    delaunay_report report;
    double x[3 * 400];
    uint32_t i, v, gone;
    for (i = 0; i < 400; i++) make_point(kind, x + 3 * i);
    CHECK(delaunay_insert(&mesh, x, 100, NULL, NULL) == DELAUNAY_OK);
    editor = delaunay_editor_new(&mesh);
    for (i = 100; i < 300; i++) {
        CHECK(delaunay_editor_insert(editor, x + 3 * i, i, 0, NULL) == DELAUNAY_OK);
        if (i % 20 == 0) CHECK(delaunay_canonicalize(&mesh, NULL) == DELAUNAY_OK);
        if (i % 20 == 10) {
            gone = mesh.vertex_of[i % 100];
            if (mesh.vertex_tet[gone]) CHECK(delaunay_editor_remove(editor, gone) == DELAUNAY_OK);
            CHECK(delaunay_insert(&mesh, x + 3 * (i % 100), 1, NULL, &report) == DELAUNAY_OK);
            v = mesh.vertex_of[mesh.num_points - 1];
            CHECK(mesh.vertex_tet[v] != 0);
            CHECK(v == gone && report.num_duplicates == 0);
        }
        CHECK(delaunay_validate(&mesh, DELAUNAY_VALIDATE_DELAUNAY, NULL) == DELAUNAY_OK);
    }
    delaunay_editor_free(editor);
    CHECK(delaunay_validate(&mesh, DELAUNAY_VALIDATE_DELAUNAY, NULL) == DELAUNAY_OK);
    CHECK(as_made_at_once(&mesh));
    delaunay_mesh_free(&mesh);
}

int main(void)
{
    int kind;
    for (kind = 0; kind < NUM_KINDS; kind++) coming_and_going(kind);
    removal_restores_the_bytes();
    many_at_once(UNIFORM);
    many_at_once(GRID);
    any_allocation_may_fail();
    again_after_failure(0);
    again_after_failure(1);
    between_calls(UNIFORM);
    between_calls(GRID);
    removal_keeps_ghosts_outside(UNIFORM);
    removal_keeps_ghosts_outside(GRID);
    what_is_refused();
    return check_report();
}
