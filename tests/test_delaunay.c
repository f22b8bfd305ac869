/* test_delaunay.c - delaunay.h: whole triangulations, compared with brute force and with each other
 * (for any number of threads and order of the points), and checked for invariants. */
#define DELAUNAY_IMPLEMENTATION
#include "../delaunay.h"
#include "check.h"
#include <limits.h>

static uint64_t random_state = 1;
static uint32_t random_u32(void)
{
    random_state = random_state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (uint32_t)(random_state >> 33);
}
static double random_unit(void) { return (double)random_u32() / 2147483648.0; }

static uint64_t hash_bytes(uint64_t h, const void *data, size_t size)
{
    const unsigned char *p = (const unsigned char *)data;
    while (size--) h = (h ^ *p++) * UINT64_C(0x100000001b3);
    return h;
}

/* Everything that a caller can read. */
static uint64_t hash_mesh(const delaunay_mesh *m)
{
    uint64_t h = UINT64_C(0xcbf29ce484222325);
    h = hash_bytes(h, m->vertices, m->num_vertices * sizeof *m->vertices);
    h = hash_bytes(h, m->vertex_id, m->num_vertices * sizeof *m->vertex_id);
    h = hash_bytes(h, m->tets, (size_t)m->num_tets * sizeof *m->tets);
    return hash_bytes(h, m->vertex_of, m->num_points * sizeof *m->vertex_of);
}

/* Every real tetrahedron of a small set is found, and no other: all spheres against all points. */
static void brute_force(const double *xyz, uint32_t n, const delaunay_mesh *mesh)
{
    uint32_t a, b, c, d, e, expected = 0;
    for (a = 0; a < n; a++)
        for (b = a + 1; b < n; b++)
            for (c = b + 1; c < n; c++)
                for (d = c + 1; d < n; d++) {
                    const double *p[4];
                    int sign, empty = 1;
                    p[0] = xyz + 3 * a;
                    p[1] = xyz + 3 * b;
                    p[2] = xyz + 3 * c;
                    p[3] = xyz + 3 * d;
                    sign = delaunay_orient3d(p[0], p[1], p[2], p[3]);
                    if (sign == 0) continue;
                    if (sign < 0) p[0] = xyz + 3 * b, p[1] = xyz + 3 * a;
                    for (e = 0; e < n && empty; e++)
                        if (e != a && e != b && e != c && e != d)
                            empty = delaunay_insphere_perturbed(p[0], p[1], p[2], p[3],
                                                                xyz + 3 * e) < 0;
                    expected += (uint32_t)empty;
                }
    CHECK(expected == delaunay_count_tets(mesh));
}

static void small_lattices(void)
{
    int round, valid = 0, flat = 0;
    for (round = 0; round < 400; round++) {
        double xyz[3 * 12], distinct[3 * 12];
        uint32_t n = 4 + random_u32() % 9, i, j, k, m = 0;
        delaunay_mesh mesh = {0};
        delaunay_result result;
        for (i = 0; i < 3 * n; i++) xyz[i] = random_u32() % 3;
        for (i = 0; i < n; i++) {
            for (j = 0; j < m; j++) {
                for (k = 0; k < 3 && distinct[3 * j + k] == xyz[3 * i + k]; k++) {}
                if (k == 3) break;
            }
            if (j == m) memcpy(distinct + 3 * m++, xyz + 3 * i, 3 * sizeof *xyz);
        }
        result = delaunay_tetrahedralize(&mesh, xyz, n, NULL, NULL);
        if (result == DELAUNAY_ERROR_DIMENSION) {
            flat++;
            continue;
        }
        CHECK(result == DELAUNAY_OK && mesh.num_vertices == m + 1);
        CHECK(delaunay_validate(&mesh, DELAUNAY_VALIDATE_DELAUNAY, NULL) == DELAUNAY_OK);
        brute_force(distinct, m, &mesh);
        delaunay_mesh_free(&mesh);
        valid++;
    }
    CHECK(valid > 300 && flat > 0);
}

enum { UNIFORM, GRID, DECIMAL, SPHERE, LINES, CLUSTERS, PLANE_AND_ONE, NUM_KINDS };

static double *make_points(int kind, size_t n)
{
    double *xyz = (double *)malloc(3 * n * sizeof *xyz);
    size_t i, side = 1;
    while (side * side * side < n) side++;
    for (i = 0; i < n; i++) {
        double *x = xyz + 3 * i, l;
        x[0] = random_unit(), x[1] = random_unit(), x[2] = random_unit();
        if (kind == GRID || kind == DECIMAL)
            x[0] = (double)(i % side), x[1] = (double)(i / side % side),
            x[2] = (double)(i / side / side);
        if (kind == DECIMAL)
            x[0] = x[0] * 0.1 + 0.3, x[1] = x[1] * 0.1 + 0.3, x[2] = x[2] * 0.1 + 0.3;
        if (kind == SPHERE) {
            x[0] -= 0.5, x[1] -= 0.5, x[2] -= 0.5;
            l = sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]) + 1e-9;
            x[0] /= l, x[1] /= l, x[2] /= l;
        }
        if (kind == LINES) {
            l = x[0];
            x[0] = i & 1 ? l : 0, x[1] = i & 1 ? 0 : l, x[2] = i & 1 ? 0 : 1;
        }
        if (kind == CLUSTERS) {
            l = pow(10, -(double)(i % 9));
            x[0] = x[0] * l + (double)(i % 5), x[1] *= l, x[2] *= l;
        }
        if (kind == PLANE_AND_ONE && i) x[2] = 0;
    }
    return xyz;
}

static void all_kinds_are_delaunay(void)
{
    static const size_t sizes[] = {30000, 8000, 3375, 8000, 300, 10000, 2000};
    int kind;
    for (kind = 0; kind < NUM_KINDS; kind++) {
        size_t n = sizes[kind], i;
        double *xyz = make_points(kind, n);
        delaunay_mesh mesh = {0};
        delaunay_report report;
        CHECK(delaunay_tetrahedralize(&mesh, xyz, n, NULL, &report) == DELAUNAY_OK);
        CHECK(report.dimension == 3 && report.num_points == n);
        CHECK(report.num_tets == delaunay_count_tets(&mesh));
        CHECK(delaunay_validate(&mesh, DELAUNAY_VALIDATE_DELAUNAY, &report) == DELAUNAY_OK);
        for (i = 0; i < n; i++)
            CHECK(memcmp(mesh.vertices[mesh.vertex_of[i]].x, xyz + 3 * i, 3 * sizeof *xyz) == 0);
        delaunay_mesh_free(&mesh);
        free(xyz);
    }
}

static int compare_quads(const void *a, const void *b) { return memcmp(a, b, 16); }

/* The set of tetrahedra as points of the first order, sorted. */
static uint32_t *set_of_tets(const delaunay_mesh *mesh, const uint32_t *back, uint64_t *count)
{
    uint64_t n = delaunay_export_tets(mesh, NULL, 0), i;
    uint32_t *tets = (uint32_t *)malloc(16 * (size_t)n + 16), t;
    int j, k;
    delaunay_export_tets(mesh, tets, n);
    for (i = 0; i < n; i++) {
        uint32_t *v = tets + 4 * i;
        for (j = 0; j < 4; j++) v[j] = back ? back[v[j]] : v[j];
        for (j = 0; j < 4; j++)
            for (k = j + 1; k < 4; k++)
                if (v[k] < v[j]) t = v[j], v[j] = v[k], v[k] = t;
    }
    qsort(tets, (size_t)n, 16, compare_quads);
    *count = n;
    return tets;
}

static void order_of_the_input_does_not_matter(void)
{
    int kind;
    for (kind = 0; kind < NUM_KINDS; kind++) {
        size_t n = 1000, i;
        double *xyz = make_points(kind, n), *shuffled = (double *)malloc(3 * n * sizeof *xyz);
        uint32_t *back = (uint32_t *)malloc(n * sizeof *back), *a, *b;
        uint64_t na, nb;
        delaunay_mesh first = {0}, second = {0};
        for (i = 0; i < n; i++) back[i] = (uint32_t)i;
        for (i = n; i-- > 1;) {
            size_t j = random_u32() % (i + 1);
            uint32_t t = back[i];
            back[i] = back[j];
            back[j] = t;
        }
        for (i = 0; i < n; i++) memcpy(shuffled + 3 * i, xyz + 3 * back[i], 3 * sizeof *xyz);
        CHECK(delaunay_tetrahedralize(&first, xyz, n, NULL, NULL) == DELAUNAY_OK);
        CHECK(delaunay_tetrahedralize(&second, shuffled, n, NULL, NULL) == DELAUNAY_OK);
        a = set_of_tets(&first, NULL, &na);
        b = set_of_tets(&second, back, &nb);
        CHECK(na == nb && memcmp(a, b, 16 * (size_t)na) == 0);
        free(a);
        free(b);
        free(back);
        free(shuffled);
        free(xyz);
        delaunay_mesh_free(&first);
        delaunay_mesh_free(&second);
    }
}

/* Memory as it comes from a heap that has been in use: with anything in it. */
static void *used_alloc(void *user, size_t size)
{
    void *block = malloc(size);
    if (block) memset(block, (int)(++*(unsigned *)user % 256), size);
    return block;
}
static void used_release(void *user, void *block)
{
    (void)user;
    free(block);
}

static void threads_do_not_matter(void)
{
    static const int threads[] = {1, 2, 3, 5, 8};
    unsigned blocks = 0;
    int kind, i;
    for (kind = 0; kind < NUM_KINDS; kind++) {
        size_t n = kind == LINES ? 400 : kind == UNIFORM ? 120000 : 20000;
        double *xyz = make_points(kind, n);
        uint64_t hash[5];
        for (i = 0; i < 5; i++) {
            delaunay_mesh mesh = {0};
            delaunay_options options;
            memset(&options, 0, sizeof options);
            options.host.num_threads = threads[i];
            options.host.allocator.alloc = used_alloc;
            options.host.allocator.release = used_release;
            options.host.allocator.user = &blocks;
            CHECK(delaunay_tetrahedralize(&mesh, xyz, n, &options, NULL) == DELAUNAY_OK);
            hash[i] = hash_mesh(&mesh);
            CHECK(hash[i] == hash[0]);
            delaunay_mesh_free(&mesh);
        }
        free(xyz);
    }
}

/* In any order the tetrahedra are the same: the canonical order makes the same bytes of them. */
static void any_order_is_the_same_set(void)
{
    const size_t n = 20000;
    double *xyz = make_points(UNIFORM, n);
    delaunay_options options;
    uint64_t hash = 0, other = 0;
    int any, equal = 0;
    memset(&options, 0, sizeof options);
    options.host.num_threads = 2;
    for (any = 0; any < 2; any++) {
        delaunay_mesh mesh = {0};
        options.any_order = any;
        CHECK(delaunay_tetrahedralize(&mesh, xyz, n, &options, NULL) == DELAUNAY_OK);
        CHECK(delaunay_validate(&mesh, DELAUNAY_VALIDATE_DELAUNAY, NULL) == DELAUNAY_OK);
        other = hash_mesh(&mesh);
        CHECK(delaunay_canonicalize(&mesh, &options.host) == DELAUNAY_OK);
        equal += other == hash_mesh(&mesh);
        CHECK(any == 0 || hash == hash_mesh(&mesh));
        hash = hash_mesh(&mesh);
        delaunay_mesh_free(&mesh);
    }
    CHECK(equal == 1); /* that of any order was another order */
    free(xyz);
}

/* Blocks grow with what is in them; sizes beyond memory, and beyond the limit, give none. */
static void memory_is_counted(void)
{
    delaunay_host host;
    delaunay_memory memory;
    unsigned char *block, *larger;
    unsigned blocks = 0;
    size_t i, sum = 0;
    memset(&host, 0, sizeof host);
    host.allocator.alloc = used_alloc;
    host.allocator.release = used_release;
    host.allocator.user = &blocks;
    host.memory_limit_bytes = 100000;
    CHECK(delaunay_memory_init(&memory, &host) == DELAUNAY_OK);
    block = (unsigned char *)delaunay_alloc_zeroed(&memory, 100, 3);
    CHECK(block && (uintptr_t)block % 64 == 0);
    for (i = 0; block && i < 300; i++) sum += block[i];
    CHECK(sum == 0);
    if (block) memset(block, 7, 300);
    larger = (unsigned char *)delaunay_grow_zeroed(&memory, block, 100, 200, 3);
    for (i = 0; larger && i < 600; i++) sum += larger[i];
    CHECK(larger && sum == 7 * 300);
    block = (unsigned char *)delaunay_grow(&memory, larger, 200, 300, 3);
    for (i = 0; block && i < 600; i++) sum -= block[i];
    CHECK(block && sum == 0 && memory.bytes >= 900 && memory.peak_bytes >= 1500);
    CHECK(!delaunay_alloc(&memory, 100001, 1) && !delaunay_alloc(&memory, SIZE_MAX / 2, 3));
    CHECK(!delaunay_grow(&memory, block, 300, SIZE_MAX / 2, 3) && block && block[599] == 0);
    delaunay_release(&memory, block);
    delaunay_release(&memory, NULL);
    CHECK(memory.bytes == 0);
}

/* Three of four points on a plane across an axis, the fourth beside it; on a line, too: the turn in
 * the plane says what the long way does. */
static void three_points_of_a_plane(void)
{
    int round, i, k, wrong = 0, zeros = 0, signs = 0;
    for (round = 0; round < 100000; round++) {
        double x[4][3], share = (double)(random_u32() % 5) / 4;
        const double *p[4];
        delaunay__exact exact;
        int axis = (int)(random_u32() % 3), apart = (int)(random_u32() % 4), found;
        int first = (apart + 1) % 4, last = (apart + 3) % 4;
        for (i = 0; i < 4; i++)
            for (k = 0; k < 3; k++)
                x[i][k] = ldexp((double)random_u32() - 2e9, (int)(random_u32() % 80) - 40);
        for (i = 0; i < 4; i++)
            if (i != apart) x[i][axis] = x[first][axis];
        if (round % 2) /* nearly, or just, on a line */
            for (k = 0; k < 3; k++)
                x[last][k] = x[first][k] + share * (x[(apart + 2) % 4][k] - x[first][k]);
        for (i = 0; i < 4; i++) p[i] = x[i];
        delaunay__exact_set(&exact, p, 4);
        found = delaunay__orient3d_long(&exact);
        zeros += found == 0;
        signs += found;
        wrong += delaunay__orient3d_by_plane(p) != found;
        wrong += delaunay_orient3d_exact(x[0], x[1], x[2], x[3]) != found;
    }
    CHECK(wrong == 0 && zeros > 1000 && signs > -9000 && signs < 9000);
}

#if defined(DELAUNAY__AVX2)
/* Coordinates of all magnitudes on each axis, often zero, often on a sphere, in a plane or in
 * line. */
static void badly_scaled_points(delaunay_vertex *x, int n)
{
    int i, k, scale[3], common = (int)(random_u32() % 240) - 120,
                        short_ones = (int)(random_u32() % 3);
    for (k = 0; k < 3; k++) scale[k] = random_u32() % 3 ? -(int)(random_u32() % 40) : 0;
    memset(x, 0, (size_t)n * sizeof *x);
    for (i = 1; i < n; i++)
        for (k = 0; k < 3; k++) {
            double c = short_ones ? (double)(random_u32() % 5) : random_unit();
            if (random_u32() % 4 == 0) c = 0;
            if (short_ones == 2) c += random_u32() % 8 ? 0 : ldexp(random_unit(), -30);
            x[i].x[k] = ldexp(c, scale[k] + common);
        }
}

/* Every filter of the vector code either knows the exact sign or says that it does not. */
static void vector_signs_are_exact(void)
{
    enum { POINTS = 9, TETS = 5 };
    int round, i, wrong = 0;
    for (round = 0; round < 100000 && DELAUNAY__AVX2; round++) {
        delaunay_vertex x[POINTS];
        delaunay_tet tets[TETS];
        delaunay_handle h[4];
        delaunay__kernel k;
        unsigned in;
        badly_scaled_points(x, POINTS);
        memset(tets, 0, sizeof tets);
        memset(&k, 0, sizeof k);
        k.vertices = x;
        k.tets = tets;
        for (i = 1; i < TETS; i++) {
            uint32_t *v = tets[i].v, first = random_u32() % 4, j;
            for (j = 0; j < 4; j++) v[j] = 2 + (first + j + (uint32_t)i) % 7;
            if (delaunay_orient3d(x[v[0]].x, x[v[1]].x, x[v[2]].x, x[v[3]].x) < 0)
                j = v[0], v[0] = v[1], v[1] = j;
            if (i > 1 && random_u32() % 8 == 0) {
                v[3] = DELAUNAY_GHOST;
                tets[i].n[3] = 4;
            }
            h[i - 1] = 4 * (delaunay_handle)i;
        }
        in = delaunay__in_conflict_avx2(&k, h, 4, x[1].x);
        for (i = 0; i < 4; i++) {
            const uint32_t *v = tets[i + 1].v;
            if (v[3] && delaunay_orient3d(x[v[0]].x, x[v[1]].x, x[v[2]].x, x[v[3]].x) == 0)
                continue;
            wrong += (int)(in >> i & 1) != delaunay__in_conflict_exact(&k, h[i] >> 2, x[1].x);
        }
    }
    CHECK(wrong == 0);
}

#  if defined(DELAUNAY__DIG)
static int compare_handles(const void *a, const void *b)
{
    delaunay_handle x = *(const delaunay_handle *)a, y = *(const delaunay_handle *)b;
    return (x > y) - (x < y);
}

/* The kernel's cavity and border, sorted and without how the search came to the tetrahedra of the
 * cavity; clears the marks. */
static delaunay_handle *take_cavity(delaunay__kernel *k)
{
    size_t n = k->num_cavity, m = k->num_border, i;
    delaunay_handle *all = (delaunay_handle *)malloc((n + m) * sizeof *all);
    for (i = 0; i < n; i++) all[i] = k->cavity[i] >> 2;
    memcpy(all + n, k->border, m * sizeof *all);
    qsort(all, n, sizeof *all, compare_handles);
    qsort(all + n, m, sizeof *all, compare_handles);
    for (i = 0; i < n; i++) k->mark[all[i]] = 0;
    for (i = 0; i < m; i++) k->mark[all[n + i] >> 2] = 0;
    return all;
}

/* Digs the cavity of the mesh's last vertex. The answer is that of the general search, or none, and
 * then it leaves no mark. */
static int dig_as_searched(delaunay__kernel *k, delaunay_handle seed, int parallel)
{
    const double *e = k->vertices[k->mesh->num_vertices - 1].x;
    delaunay_handle *dug, *searched, t;
    size_t n, m;
    int result;
    k->parallel = parallel;
    k->length = UINT32_MAX;
    result = delaunay__dig(k, seed, e);
    if (result != DELAUNAY_OK) {
        CHECK(result == DELAUNAY__NOT_SURE || result == DELAUNAY__NOT_HERE);
        for (t = 0; t < k->mesh->num_tets; t++)
            if (k->mark[t]) break;
        CHECK(t == k->mesh->num_tets);
        return 0;
    }
    n = k->num_cavity, m = k->num_border;
    dug = take_cavity(k);
    CHECK(delaunay__search_cavity(k, seed, e) == DELAUNAY_OK);
    CHECK(k->num_cavity == n && k->num_border == m);
    searched = take_cavity(k);
    if (k->num_cavity == n && k->num_border == m)
        CHECK(memcmp(dug, searched, (n + m) * sizeof *dug) == 0);
    free(dug);
    free(searched);
    return 1;
}

static int dig_in(const double *xyz, size_t n, int rounds)
{
    delaunay_mesh mesh = {0};
    delaunay__kernel k;
    int round, dug = 0;
    if (delaunay_tetrahedralize(&mesh, xyz, n, NULL, NULL) != DELAUNAY_OK || !mesh.num_tets) {
        delaunay_mesh_free(&mesh);
        return 0;
    }
    CHECK(delaunay_add_vertex(&mesh, xyz, DELAUNAY_NO_ID) != 0);
    CHECK(delaunay__kernel_init(&k, &mesh) == DELAUNAY_OK);
    for (round = 0; round < rounds; round++) {
        double *e = mesh.vertices[mesh.num_vertices - 1].x;
        const double *p = xyz + 3 * (random_u32() % n), *q = xyz + 3 * (random_u32() % n);
        double part = random_u32() % 3 ? random_unit() * 1.2 : 0.5;
        delaunay_handle seed;
        int i;
        for (i = 0; i < 3; i++) e[i] = p[i] + part * (q[i] - p[i]);
        seed = delaunay__walk_exact(&k, delaunay__any_tet(&mesh, 1), e, (uint32_t)round);
        if (delaunay__in_conflict(&k, seed, e)) dug += dig_as_searched(&k, seed, round & 1);
    }
    delaunay__kernel_free(&k);
    delaunay_mesh_free(&mesh);
    return dug;
}

/* Digging finds what the general search finds, or says that it does not know. */
static void digging_is_searching(void)
{
    enum { FEW = 60 };
    int kind, round, i, dug = 0;
    for (kind = 0; kind < NUM_KINDS; kind++) {
        double *xyz = make_points(kind, 2000);
        int times = dig_in(xyz, 2000, 1000);
        CHECK(times > 800 || kind != UNIFORM);
        free(xyz);
    }
    for (round = 0; round < 500; round++) {
        delaunay_vertex x[FEW];
        double xyz[3 * FEW];
        badly_scaled_points(x, FEW);
        for (i = 0; i < FEW; i++) memcpy(xyz + 3 * i, x[i].x, sizeof x[i].x);
        dug += dig_in(xyz, FEW, 50);
    }
    CHECK(dug > 500);
}
#  endif
#endif

/* Moves vertices about, as long as all tetrahedra stay positive: no Delaunay mesh any more. */
static void shake(delaunay_mesh *m, double by)
{
    uint32_t v;
    for (v = 1; v < m->num_vertices; v++) {
        double *x = m->vertices[v].x, old[3];
        delaunay_handle t;
        int k, bad = 0;
        memcpy(old, x, sizeof old);
        for (k = 0; k < 3; k++) x[k] += by * (random_unit() - 0.5);
        for (t = 1; t < m->num_tets && !bad; t++) {
            const uint32_t *w = m->tets[t].v;
            if (w[0] != v && w[1] != v && w[2] != v && w[3] != v) continue;
            bad = w[3] == DELAUNAY_GHOST || /* the hull stays */
                  delaunay_orient3d(m->vertices[w[0]].x, m->vertices[w[1]].x, m->vertices[w[2]].x,
                                    m->vertices[w[3]].x) <= 0;
        }
        if (bad) memcpy(x, old, sizeof old);
    }
}

static int has_inside(const delaunay_mesh *m, delaunay_handle t, const double *x)
{
    const uint32_t *v = m->tets[t].v;
    return v[3] != DELAUNAY_GHOST &&
           delaunay_insphere_perturbed(m->vertices[v[0]].x, m->vertices[v[1]].x,
                                       m->vertices[v[2]].x, m->vertices[v[3]].x, x) > 0;
}

/* What delaunay_plain_cavity promises, looked up: in is 1 for tetrahedra of the cavity. */
static void check_plain(const delaunay_mesh *m, const delaunay_plain *c, const double *x,
                        uint8_t *in, uint32_t key)
{
    uint32_t k, i, outer = 0, inner = 0;
    unsigned flags = 0;
    CHECK(c->num_tets >= 1 && c->num_tets <= DELAUNAY_PLAIN_MOST);
    for (k = 0; k < c->num_tets; k++) {
        CHECK(!in[c->tets[k] >> 2]);
        CHECK(k == 0 || in[m->tets[c->tets[k] >> 2].n[c->tets[k] & 3] >> 2]);
        in[c->tets[k] >> 2] = 1;
        flags |= m->flags[c->tets[k] >> 2];
    }
    for (k = 0; k < c->num_tets; k++) {
        delaunay_handle t = c->tets[k] >> 2;
        CHECK(has_inside(m, t, x));
        for (i = 0; i < 4; i++) {
            const uint8_t *f = delaunay_facet_order((int)i);
            const uint32_t *v = m->tets[t].v;
            CHECK(m->vertices[v[i]].key == key);
            if (!(m->flags[t] & DELAUNAY_FACET_BIT(i))) {
                CHECK(has_inside(m, m->tets[t].n[i] >> 2, x) == in[m->tets[t].n[i] >> 2]);
                if (in[m->tets[t].n[i] >> 2]) {
                    inner++;
                    continue;
                }
            }
            CHECK(outer < c->num_border && c->border[outer] == 4 * t + i);
            CHECK(delaunay_orient3d(x, m->vertices[v[f[0]]].x, m->vertices[v[f[1]]].x,
                                    m->vertices[v[f[2]]].x) > 0);
            outer++;
        }
    }
    CHECK(outer == c->num_border && inner + outer == 4 * c->num_tets && c->flags == flags);
    for (k = 0; k < c->num_tets; k++) in[c->tets[k] >> 2] = 0;
}

/* True if the search for a cavity from t meets one with a vertex of another key. */
static int leads_elsewhere(const delaunay_mesh *m, delaunay_handle t, const double *x, uint8_t *in,
                           uint32_t key)
{
    static delaunay_handle list[4096];
    size_t n = 1, k;
    int i, elsewhere = 0;
    list[0] = t;
    in[t] = 1;
    for (k = 0; k < n; k++)
        for (i = 0; i < 4; i++) {
            delaunay_handle h = m->tets[list[k]].n[i];
            elsewhere |= m->vertices[m->tets[list[k]].v[i]].key != key;
            if (in[h >> 2] || n == 4096 || !has_inside(m, h >> 2, x)) continue;
            in[h >> 2] = 1;
            list[n++] = h >> 2;
        }
    for (k = 0; k < n; k++) in[list[k]] = 0;
    return elsewhere;
}

/* A plain cavity with a facet of it constrained, one inside or on its boundary: what is left of it
 * on this side, if x sees the facet; and with an edge constrained, which it tells. Returns whether
 * the facet was inside, and the rest plain. */
static int constrain_plain(delaunay_mesh *m, delaunay_worker *w, const delaunay_plain *whole,
                           const double *x, uint8_t *in, uint32_t key)
{
    const delaunay_handle one = whole->tets[random_u32() % whole->num_tets] >> 2;
    const delaunay_handle facet = 4 * one + 3;
    const uint8_t *f = delaunay_facet_order(3);
    const uint32_t *v = m->tets[one].v;
    const int sees = delaunay_orient3d(x, m->vertices[v[f[0]]].x, m->vertices[v[f[1]]].x,
                                       m->vertices[v[f[2]]].x) > 0;
    delaunay_plain c;
    delaunay_plainness answer;
    int fewer = 0;
    delaunay_mark_facet(m, facet, 1);
    answer = delaunay_plain_cavity(&c, m, x, whole->tets[0] >> 2, NULL);
    CHECK(answer != DELAUNAY_PLAIN_ELSEWHERE);
    if (answer == DELAUNAY_PLAIN) {
        check_plain(m, &c, x, in, key);
        CHECK(c.num_tets <= whole->num_tets);
        fewer = sees && c.num_tets < whole->num_tets;
    }
    delaunay_mark_facet(m, facet, 0);
    CHECK(delaunay_mark_edge(m, w, one, v[0], v[1], 1) == DELAUNAY_OK);
    CHECK(delaunay_plain_cavity(&c, m, x, whole->tets[0] >> 2, NULL) == DELAUNAY_PLAIN);
    check_plain(m, &c, x, in, key);
    CHECK((c.flags & DELAUNAY_EDGE_BITS) && c.num_tets == whole->num_tets);
    CHECK(delaunay_mark_edge(m, w, one, v[0], v[1], 0) == DELAUNAY_OK);
    return fewer;
}

/* Points in a mesh whose vertices have the keys 0 and 1; returns how many cavities were plain. */
static int plain_in(delaunay_mesh *m, int points, int *elsewhere, int *cut)
{
    uint8_t *in = (uint8_t *)calloc(m->num_tets, 1);
    delaunay_worker *w = delaunay_worker_new(&m->memory);
    delaunay_plain c;
    int plain = 0, i, k;
    while (points-- > 0) {
        delaunay_handle t = 1 + random_u32() % (m->num_tets - 1);
        const uint32_t *v = m->tets[t].v;
        double x[3], weight[4], sum = 0;
        delaunay_plainness answer;
        uint32_t key;
        if (v[3] == DELAUNAY_GHOST || !v[0]) continue;
        for (i = 0; i < 4; i++) sum += weight[i] = 0.01 + random_unit();
        for (k = 0; k < 3; k++)
            for (x[k] = 0, i = 0; i < 4; i++) x[k] += weight[i] / sum * m->vertices[v[i]].x[k];
        if (!has_inside(m, t, x)) continue;
        key = m->vertices[v[0]].key;
        for (i = 1; i < 4; i++) key = m->vertices[v[i]].key == key ? key : 2;
        if (key == 2) continue;
        answer = delaunay_plain_cavity(&c, m, x, t, &key);
        if (answer == DELAUNAY_PLAIN) check_plain(m, &c, x, in, key);
        if (answer == DELAUNAY_PLAIN_ELSEWHERE) CHECK(leads_elsewhere(m, t, x, in, key));
        if (answer == DELAUNAY_PLAIN) CHECK(!leads_elsewhere(m, t, x, in, key));
        for (k = 0; k < (int)m->num_tets; k++)
            if (m->mark[k]) break;
        CHECK(k == (int)m->num_tets);
        if (answer != DELAUNAY_PLAIN) {
            *elsewhere += answer == DELAUNAY_PLAIN_ELSEWHERE;
            continue;
        }
        plain++;
        *cut += constrain_plain(m, w, &c, x, in, key);
    }
    delaunay_worker_free(w);
    free(in);
    return plain;
}

static void plain_cavities_are_cavities(void)
{
    int kind, shaken, all[2] = {0, 0}, elsewhere = 0, cut = 0;
    uint32_t v;
    for (kind = 0; kind < NUM_KINDS; kind++)
        for (shaken = 0; shaken < 2; shaken++) {
            double *xyz = make_points(kind, 1500);
            delaunay_mesh mesh = {0};
            CHECK(delaunay_tetrahedralize(&mesh, xyz, 1500, NULL, NULL) == DELAUNAY_OK);
            if (shaken) shake(&mesh, kind == GRID ? 0.3 : 0.03);
            CHECK(delaunay_enable_marks(&mesh) == DELAUNAY_OK);
            CHECK(delaunay_link_vertices(&mesh) == DELAUNAY_OK);
            for (v = 1; v < mesh.num_vertices; v++)
                mesh.vertices[v].key = mesh.vertices[v].x[0] > 0.4;
            all[shaken] += plain_in(&mesh, 1500, &elsewhere, &cut);
            delaunay_mesh_free(&mesh);
            free(xyz);
        }
#if defined(DELAUNAY__DIG)
    if (DELAUNAY__AVX2) CHECK(all[0] > 1000 && all[1] > 1000 && elsewhere > 100 && cut > 100);
#endif
}

/* As a rotation leaves them: what should be 0 is not, and no other coordinate is so small. */
static void grids_with_residues(void)
{
    static const double first[18] = {1e-20, 1, 1, 2, 1, 1, 1, 0, 1, 1, 2, 1, 1, 1, 0, 1, 1, 2};
    double xyz[3 * 40];
    int run, n = 6, i;
    memcpy(xyz, first, sizeof first);
    for (run = 0; run < 1500; run++) {
        delaunay_mesh mesh = {0};
        delaunay_report report;
        delaunay_result result = delaunay_tetrahedralize(&mesh, xyz, (size_t)n, NULL, &report);
        CHECK(result == DELAUNAY_OK || result == DELAUNAY_ERROR_DIMENSION);
        if (result == DELAUNAY_OK)
            CHECK(delaunay_validate(&mesh, DELAUNAY_VALIDATE_DELAUNAY, &report) == DELAUNAY_OK);
        delaunay_mesh_free(&mesh);
        n = 6 + (int)(random_u32() % 34);
        for (i = 0; i < 3 * n; i++) {
            xyz[i] = random_u32() % (2 + (uint32_t)run % 4);
            if (xyz[i] == 0) xyz[i] = run & 4 ? 6e-17 : -1e-19;
        }
    }
}

static void few_and_flat_points(void)
{
    double xyz[3 * 6] = {0, 0, 0, 1, 1, 1, 2, 2, 2, 0, 0, 0, 1, 0, 0, 3, 3, 3},
                   bad[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
    static const int dimension[7] = {-1, 0, 1, 1, 1, 2, 2};
    delaunay_mesh mesh = {0};
    delaunay_report report;
    size_t n;
    for (n = 0; n <= 6; n++) {
        CHECK(delaunay_tetrahedralize(&mesh, xyz, n, NULL, &report) == DELAUNAY_ERROR_DIMENSION);
        CHECK(report.dimension == dimension[n] && report.message[0]);
        CHECK(mesh.tets == NULL && mesh.memory.bytes == 0);
    }
    bad[4] = NAN;
    bad[11] = INFINITY;
    CHECK(delaunay_tetrahedralize(&mesh, bad, 4, NULL, &report) == DELAUNAY_ERROR_NOT_FINITE);
    CHECK(report.num_ids == 2 && report.ids[0] == 1 && report.ids[1] == 3);
    CHECK(delaunay_tetrahedralize(&mesh, NULL, 4, NULL, &report) ==
          DELAUNAY_ERROR_INVALID_ARGUMENT);
}

/* What a wrong argument leaves: everything. */
static void wrong_arguments_leave_the_mesh(void)
{
    size_t n = 50;
    double *xyz = make_points(UNIFORM, n);
    delaunay_mesh mesh = {0};
    delaunay_options options = {0};
    delaunay_report report;
    uint64_t tets;
    CHECK(delaunay_tetrahedralize(&mesh, xyz, n - 1, NULL, &report) == DELAUNAY_OK);
    tets = delaunay_count_tets(&mesh);
    options.host.num_threads = -1;
    CHECK(delaunay_tetrahedralize(&mesh, xyz, n, &options, &report) ==
              DELAUNAY_ERROR_INVALID_ARGUMENT && strstr(report.message, "threads"));
    CHECK(delaunay_insert(&mesh, xyz + 3 * (n - 1), 1, &options, &report) ==
              DELAUNAY_ERROR_INVALID_ARGUMENT && strstr(report.message, "threads"));
    CHECK(delaunay_tetrahedralize(&mesh, NULL, n, NULL, &report) ==
          DELAUNAY_ERROR_INVALID_ARGUMENT);
    CHECK(delaunay_count_tets(&mesh) == tets && mesh.num_points == n - 1);
    CHECK(delaunay_validate(&mesh, DELAUNAY_VALIDATE_DELAUNAY, NULL) == DELAUNAY_OK);
    delaunay_mesh_free(&mesh);
    free(xyz);
}

static void duplicates_map_to_the_first(void)
{
    size_t n = 20000, i;
    double *xyz = make_points(UNIFORM, n);
    delaunay_mesh mesh = {0};
    delaunay_report report;
    for (i = 50; i < n; i++) memcpy(xyz + 3 * i, xyz + 3 * (random_u32() % 50), 3 * sizeof *xyz);
    CHECK(delaunay_tetrahedralize(&mesh, xyz, n, NULL, &report) == DELAUNAY_OK);
    CHECK(report.num_vertices == 50 && report.num_duplicates == n - 50);
    for (i = 0; i < n; i++) {
        uint32_t id = mesh.vertex_id[mesh.vertex_of[i]];
        CHECK(id < 50 && memcmp(xyz + 3 * id, xyz + 3 * i, 3 * sizeof *xyz) == 0);
    }
    delaunay_mesh_free(&mesh);
    free(xyz);
}

/* An allocator that fails from the k-th call on and knows what is outstanding. */
typedef struct failing {
    long calls, fail_at, live;
} failing;
static void *failing_alloc(void *user, size_t size)
{
    failing *f = (failing *)user;
    if (++f->calls >= f->fail_at) return NULL;
    f->live++;
    return malloc(size);
}
static void failing_release(void *user, void *block)
{
    ((failing *)user)->live--;
    free(block);
}

static delaunay_options with_failing(failing *f, long fail_at, int num_threads)
{
    delaunay_options options;
    memset(&options, 0, sizeof options);
    memset(f, 0, sizeof *f);
    f->fail_at = fail_at;
    options.host.allocator.alloc = failing_alloc;
    options.host.allocator.release = failing_release;
    options.host.allocator.user = f;
    options.host.num_threads = num_threads;
    return options;
}

static void any_allocation_may_fail(void)
{
    size_t n = 3000;
    double *xyz = make_points(SPHERE, n);
    long k;
    for (k = 1;; k++) {
        failing f;
        delaunay_mesh mesh = {0};
        const delaunay_options options = with_failing(&f, k, 0);
        const delaunay_result result = delaunay_tetrahedralize(&mesh, xyz, n, &options, NULL);
        CHECK(result == (f.calls >= k ? DELAUNAY_ERROR_OUT_OF_MEMORY : DELAUNAY_OK));
        if (result == DELAUNAY_OK) {
            CHECK(delaunay_validate(&mesh, DELAUNAY_VALIDATE_TOPOLOGY, NULL) == DELAUNAY_OK);
            delaunay_mesh_free(&mesh);
        }
        CHECK(f.live == 0);
        if (result == DELAUNAY_OK) break;
    }
    CHECK(k > 10);
    free(xyz);
}

/* With several threads a failure may also be got over. */
static void any_allocation_of_threads_may_fail(void)
{
    size_t n = 8000;
    double *xyz = make_points(UNIFORM, n);
    uint64_t hash = 0;
    long k, calls = 0, failures = 0;
    for (k = 0; k <= calls; k++) { /* 0: none fails */
        failing f;
        delaunay_mesh mesh = {0};
        const delaunay_options options = with_failing(&f, k ? k : LONG_MAX, 4);
        const delaunay_result result = delaunay_tetrahedralize(&mesh, xyz, n, &options, NULL);
        if (k == 0) {
            CHECK(result == DELAUNAY_OK);
            hash = hash_mesh(&mesh);
            calls = f.calls;
        }
        CHECK(result == DELAUNAY_ERROR_OUT_OF_MEMORY ||
              (result == DELAUNAY_OK && hash_mesh(&mesh) == hash));
        failures += result != DELAUNAY_OK;
        delaunay_mesh_free(&mesh);
        CHECK(f.live == 0);
    }
    CHECK(failures > 10);
    free(xyz);
}

/* Of a mesh with a vertex of very many tetrahedra; the one that fails is as it was. */
static void canonical_order_may_lack_memory(void)
{
    size_t n = 2000;
    double *xyz = make_points(SPHERE, n);
    delaunay_mesh mesh = {0};
    failing f;
    delaunay_options options = with_failing(&f, LONG_MAX, 0);
    uint64_t before, canonical;
    delaunay_result result = DELAUNAY_ERROR_OUT_OF_MEMORY;
    delaunay_handle t;
    int marks;
    long k;
    xyz[0] = xyz[1] = xyz[2] = 0; /* the centre */
    CHECK(delaunay_tetrahedralize(&mesh, xyz, n, &options, NULL) == DELAUNAY_OK);
    canonical = hash_mesh(&mesh);
    delaunay_mesh_free(&mesh);
    options.any_order = 1;
    CHECK(delaunay_tetrahedralize(&mesh, xyz, n, &options, NULL) == DELAUNAY_OK);
    before = hash_mesh(&mesh);
    CHECK(before != canonical);
    for (k = 1; result != DELAUNAY_OK && k < 100; k++) {
        long live = f.live;
        f.fail_at = f.calls + k;
        result = delaunay_canonicalize(&mesh, &options.host);
        f.fail_at = LONG_MAX;
        CHECK(result == DELAUNAY_OK || result == DELAUNAY_ERROR_OUT_OF_MEMORY);
        CHECK(hash_mesh(&mesh) == (result == DELAUNAY_OK ? canonical : before));
        CHECK(f.live == live);
        for (t = 0, marks = 0; t < mesh.num_tets; t++) marks |= mesh.mark[t];
        CHECK(marks == 0);
        CHECK(delaunay_validate(&mesh, DELAUNAY_VALIDATE_TOPOLOGY, NULL) == DELAUNAY_OK);
    }
    CHECK(result == DELAUNAY_OK && k > 8); /* six arrays, and the pairs of a bucket */
    delaunay_mesh_free(&mesh);
    CHECK(f.live == 0);
    free(xyz);
}

/* The tetrahedra of mesh, the i-th one of a random order for i, coloured, one facet in three
 * constrained; then in canonical order. */
static void import_shuffled(delaunay_mesh *copy, const double *xyz, size_t n, const uint32_t *tets,
                            size_t count, uint32_t seed)
{
    uint32_t *mixed = (uint32_t *)malloc(16 * count), *colors = (uint32_t *)malloc(4 * count), x[4];
    size_t i, j;
    delaunay_handle f;
    for (i = 0; i < count; i++) {
        seed = seed * 1664525u + 1013904223u;
        j = seed % (i + 1);
        memcpy(x, tets + 4 * i, sizeof x);
        memcpy(mixed + 4 * i, mixed + 4 * j, i == j ? 0 : sizeof x);
        memcpy(mixed + 4 * j, x, sizeof x);
    }
    for (i = 0; i < count; i++)
        colors[i] = mixed[4 * i] ^ mixed[4 * i + 1] ^ mixed[4 * i + 2] ^ mixed[4 * i + 3];
    CHECK(delaunay_import(copy, xyz, n, mixed, colors, count, NULL, NULL) == DELAUNAY_OK);
    for (f = 4; f < 4 * copy->num_tets; f++) {
        const uint8_t *v = delaunay_facet_vertices[f & 3];
        const uint32_t *w = copy->tets[f >> 2].v;
        if ((w[v[0]] + w[v[1]] + w[v[2]]) % 3 == 0) delaunay_mark_facet(copy, f, 1);
    }
    CHECK(delaunay_canonicalize(copy, NULL) == DELAUNAY_OK);
    CHECK(delaunay_validate(copy, DELAUNAY_VALIDATE_GEOMETRY, NULL) == DELAUNAY_OK);
    free(mixed);
    free(colors);
}

static void canonical_order_forgets_the_slots(void)
{
    size_t n = 3000;
    double *xyz = make_points(UNIFORM, n);
    delaunay_mesh mesh = {0}, a = {0}, b = {0};
    uint32_t *tets, seed;
    uint64_t count;
    CHECK(delaunay_tetrahedralize(&mesh, xyz, n, NULL, NULL) == DELAUNAY_OK);
    count = delaunay_export_tets(&mesh, NULL, 0);
    tets = (uint32_t *)malloc(16 * (size_t)count);
    CHECK(delaunay_export_tets(&mesh, tets, count) == count);
    import_shuffled(&a, xyz, n, tets, (size_t)count, 1);
    for (seed = 2; seed < 5; seed++) {
        import_shuffled(&b, xyz, n, tets, (size_t)count, seed);
        CHECK(a.num_tets == b.num_tets);
        CHECK(memcmp(a.tets, b.tets, a.num_tets * sizeof *a.tets) == 0);
        CHECK(memcmp(a.color, b.color, a.num_tets * sizeof *a.color) == 0);
        CHECK(memcmp(a.flags, b.flags, a.num_tets * sizeof *a.flags) == 0);
    }
    delaunay_mesh_free(&mesh);
    delaunay_mesh_free(&a);
    delaunay_mesh_free(&b);
    free(tets);
    free(xyz);
}

static void import_and_validate(void)
{
    size_t n = 500, i;
    double *xyz = make_points(UNIFORM, n);
    delaunay_mesh mesh = {0}, copy = {0};
    delaunay_report report;
    uint64_t count;
    uint32_t *tets, *colors, t;
    CHECK(delaunay_tetrahedralize(&mesh, xyz, n, NULL, NULL) == DELAUNAY_OK);
    count = delaunay_export_tets(&mesh, NULL, 0);
    tets = (uint32_t *)malloc(16 * (size_t)count);
    colors = (uint32_t *)malloc(4 * (size_t)count);
    CHECK(delaunay_export_tets(&mesh, tets, count) == count);
    for (i = 0; i < count; i++) colors[i] = (uint32_t)i % 3;
    CHECK(delaunay_import(&copy, xyz, n, tets, colors, (size_t)count, NULL, &report) ==
          DELAUNAY_OK);
    CHECK(delaunay_count_tets(&copy) == count && copy.color[2] == 1);
    CHECK(delaunay_link_vertices(&copy) == DELAUNAY_OK);
    CHECK(delaunay_validate(&copy, DELAUNAY_VALIDATE_DELAUNAY, NULL) == DELAUNAY_OK);
    CHECK(delaunay_canonicalize(&copy, NULL) == DELAUNAY_OK);
    CHECK(delaunay_validate(&copy, DELAUNAY_VALIDATE_DELAUNAY, NULL) == DELAUNAY_OK);
    for (i = 0; i < count; i++) t = tets[4 * i], tets[4 * i] = tets[4 * i + 1], tets[4 * i + 1] = t;
    CHECK(delaunay_import(&copy, xyz, n, tets, NULL, (size_t)count, NULL, &report) == DELAUNAY_OK);
    CHECK(delaunay_validate(&copy, DELAUNAY_VALIDATE_DELAUNAY, NULL) == DELAUNAY_OK);
    t = tets[0], tets[0] = tets[1], tets[1] = t;
    CHECK(delaunay_import(&copy, xyz, n, tets, NULL, (size_t)count, NULL, &report) ==
          DELAUNAY_ERROR_INVALID_MESH);
    CHECK(copy.tets == NULL && report.num_ids == 1);
    t = tets[0], tets[0] = tets[1], tets[1] = t;
    memcpy(tets + 4 * 9, tets + 4 * 5, 4 * sizeof *tets); /* the same one twice */
    CHECK(delaunay_import(&copy, xyz, n, tets, NULL, (size_t)count, NULL, &report) ==
          DELAUNAY_ERROR_INVALID_MESH);
    CHECK(copy.tets == NULL && report.num_ids == 1 && report.ids[0] == 9);

    mesh.tets[7].n[2] ^= 1;
    CHECK(delaunay_validate(&mesh, DELAUNAY_VALIDATE_TOPOLOGY, &report) ==
          DELAUNAY_ERROR_INVALID_MESH);
    CHECK(report.num_ids > 0 && report.message[0]);
    mesh.tets[7].n[2] ^= 1;
    CHECK(delaunay_validate(&mesh, DELAUNAY_VALIDATE_DELAUNAY, &report) == DELAUNAY_OK);
    mesh.vertices[20].x[0] += 10;
    CHECK(delaunay_validate(&mesh, DELAUNAY_VALIDATE_GEOMETRY, &report) ==
          DELAUNAY_ERROR_INVALID_MESH);
    delaunay_mesh_free(&mesh);
    delaunay_mesh_free(&copy);
    free(colors);
    free(tets);
    free(xyz);
}

/* Compares an export of the first cap tetrahedra with numbers counted here, and checks that nothing
 * is written beyond them. Works in tets, which has room for all. */
static void check_export(const delaunay_mesh *mesh, uint32_t *tets, uint64_t cap)
{
    const uint32_t untouched = 0xabcdef;
    uint64_t count = delaunay_count_tets(mesh), n = 0, i;
    uint32_t *id = (uint32_t *)malloc(mesh->num_vertices * sizeof *id), next = mesh->num_points, v;
    delaunay_handle t;
    for (v = 1; v < mesh->num_vertices; v++)
        id[v] = mesh->vertex_id[v] == DELAUNAY_NO_ID ? next++ : mesh->vertex_id[v];
    for (i = 0; i < 4 * count; i++) tets[i] = untouched;
    CHECK(delaunay_export_tets(mesh, tets, cap) == count);
    for (t = 1; t < mesh->num_tets; t++) {
        if (delaunay_is_deleted(mesh, t) || delaunay_is_ghost(mesh, t)) continue;
        for (i = 0; i < 4; i++)
            CHECK(tets[4 * n + i] == (n < cap ? id[mesh->tets[t].v[i]] : untouched));
        n++;
    }
    free(id);
}

/* Vertices without an id in one run, in some, and everywhere. */
static void exported_vertices_are_numbered_in_order(void)
{
    size_t n = 3000;
    double *xyz = make_points(UNIFORM, n);
    delaunay_mesh mesh = {0};
    uint32_t *tets, v, pattern;
    uint64_t count;
    CHECK(delaunay_tetrahedralize(&mesh, xyz, n, NULL, NULL) == DELAUNAY_OK);
    count = delaunay_count_tets(&mesh);
    tets = (uint32_t *)malloc(16 * (size_t)count);
    for (pattern = 0; pattern < 7; pattern++) {
        for (v = 1; v < mesh.num_vertices; v++) {
            int own = pattern == 1   ? v > n / 2
                      : pattern == 2 ? v > 10 && v < n / 2
                      : pattern == 3 ? v / 700 % 2 == 0
                      : pattern == 4 ? v % 2 == 0
                      : pattern == 5 ? v == 5 || v + 1 == mesh.num_vertices
                                     : pattern == 6;
            mesh.vertex_id[v] = own ? DELAUNAY_NO_ID : v - 1;
        }
        check_export(&mesh, tets, count);
        check_export(&mesh, tets, UINT64_MAX);
        check_export(&mesh, tets, count / 3);
        check_export(&mesh, tets, 1);
        check_export(&mesh, tets, 0);
    }
    delaunay_mesh_free(&mesh);
    free(tets);
    free(xyz);
}

/* If every level up to this one were checked, this would take hours. */
static void levels_beyond_the_last_are_the_last(void)
{
    size_t n = 50;
    double *xyz = make_points(UNIFORM, n);
    delaunay_mesh mesh = {0};
    CHECK(delaunay_tetrahedralize(&mesh, xyz, n, NULL, NULL) == DELAUNAY_OK);
    CHECK(delaunay_validate(&mesh, INT_MAX, NULL) == DELAUNAY_OK);
    mesh.vertices[20].x[0] += 0.7; /* far from where it was */
    CHECK(delaunay_validate(&mesh, INT_MAX, NULL) == DELAUNAY_ERROR_INVALID_MESH);
    CHECK(delaunay_validate(&mesh, -1, NULL) == DELAUNAY_OK);
    delaunay_mesh_free(&mesh);
    free(xyz);
}

static int stop_at_once(void *user, const char *phase, double fraction)
{
    (void)user, (void)phase, (void)fraction;
    return 1;
}

static void cancelled_leaves_nothing(void)
{
    size_t n = 50000;
    double *xyz = make_points(UNIFORM, n);
    delaunay_mesh mesh = {0};
    delaunay_options options;
    memset(&options, 0, sizeof options);
    options.host.progress = stop_at_once;
    CHECK(delaunay_tetrahedralize(&mesh, xyz, n, &options, NULL) == DELAUNAY_CANCELLED);
    CHECK(mesh.tets == NULL);
    free(xyz);
}

static int stop_in_time(void *user, const char *phase, double fraction)
{
    (void)phase, (void)fraction;
    return --*(int *)user == 0;
}

/* At any time, and of more threads than two. */
static void cancelled_at_any_time(void)
{
    size_t n = 50000;
    double *xyz = make_points(UNIFORM, n);
    int k, left = -1;
    for (k = 1; left <= 0; k++) {
        delaunay_mesh mesh = {0};
        delaunay_options options;
        delaunay_result result;
        memset(&options, 0, sizeof options);
        options.host.progress = stop_in_time;
        options.host.user = &left;
        options.host.num_threads = 4;
        left = k;
        result = delaunay_tetrahedralize(&mesh, xyz, n, &options, NULL);
        CHECK(result == (left > 0 ? DELAUNAY_OK : DELAUNAY_CANCELLED));
        CHECK((mesh.tets == NULL) == (result != DELAUNAY_OK));
        delaunay_mesh_free(&mesh);
    }
    CHECK(k > 5);
    free(xyz);
}

/* The last fraction told; 2 after one that was below it or beyond 1. */
static int note_fraction(void *user, const char *phase, double fraction)
{
    double *last = (double *)user;
    (void)phase;
    if (fraction < *last || !(fraction <= 1)) fraction = 2;
    *last = fraction;
    return 0;
}

static void progress_comes_to_one(void)
{
    static const int kinds[] = {UNIFORM, SPHERE, GRID};
    size_t n = 100000;
    int k, threads;
    for (k = 0; k < 3; k++)
        for (threads = 1; threads <= 3; threads++) {
            double *xyz = make_points(kinds[k], n), last = 0;
            delaunay_mesh mesh = {0};
            delaunay_options options = {0};
            options.host.num_threads = threads;
            options.host.progress = note_fraction;
            options.host.user = &last;
            CHECK(delaunay_tetrahedralize(&mesh, xyz, n, &options, NULL) == DELAUNAY_OK);
            CHECK(last > 0.5 && last <= 1);
            delaunay_mesh_free(&mesh);
            free(xyz);
        }
}

static void results_have_sentences(void)
{
    static const int codes[] = {DELAUNAY_OK,
                                DELAUNAY_STOPPED_BY_BUDGET,
                                DELAUNAY_GOAL_NOT_MET,
                                DELAUNAY_ERROR_INVALID_ARGUMENT,
                                DELAUNAY_ERROR_OUT_OF_MEMORY,
                                DELAUNAY_CANCELLED,
                                DELAUNAY_ERROR_TOO_LARGE,
                                DELAUNAY_ERROR_INTERNAL,
                                DELAUNAY_ERROR_DIMENSION,
                                DELAUNAY_ERROR_NOT_FINITE,
                                DELAUNAY_ERROR_INVALID_MESH,
                                DELAUNAY_ERROR_BROKEN_ARITHMETIC};
    const char *unknown = delaunay_result_string((delaunay_result)-1000);
    size_t i, j;
    for (i = 0; i < sizeof codes / sizeof *codes; i++) {
        const char *text = delaunay_result_string((delaunay_result)codes[i]);
        CHECK(strcmp(text, unknown) != 0);
        for (j = 0; j < i; j++)
            CHECK(strcmp(text, delaunay_result_string((delaunay_result)codes[j])) != 0);
    }
}

/* The address sanitizers of gcc and clang keep what is freed for a while. */
#if defined(__SANITIZE_ADDRESS__)
#  define KEEPS_WHAT_IS_FREED
#elif defined(__has_feature)
#  if __has_feature(address_sanitizer)
#    define KEEPS_WHAT_IS_FREED
#  endif
#endif
#if defined(__linux__) && defined(__GLIBC__) && !defined(KEEPS_WHAT_IS_FREED)
#  define HEAP_IS_GLIBCS
#endif

#if defined(HEAP_IS_GLIBCS)
static size_t pages_of_process(void)
{
    unsigned long pages = 0;
    FILE *file = fopen("/proc/self/statm", "r");
    if (!file) return 0;
    CHECK(fscanf(file, "%lu", &pages) == 1);
    fclose(file);
    return (size_t)pages;
}

/* Blocks like those of a triangulation, again and again, fit where the first ones were. */
static void freed_blocks_are_used_again(void)
{
    const size_t mb = 1 << 20;
    delaunay_memory m;
    size_t before = 0;
    int i;
    delaunay_memory_init(&m, NULL);
    for (i = 0; i < 12; i++) {
        void *keys = delaunay_alloc(&m, 16, mb), *values = delaunay_alloc(&m, 8, mb);
        void *vertices, *tets, *moved, *spare;
        delaunay_release(&m, values);
        values = delaunay_alloc(&m, 16, mb);
        vertices = delaunay_alloc(&m, 28, mb);
        delaunay_release(&m, keys);
        delaunay_release(&m, values);
        tets = delaunay_alloc(&m, 210, mb);
        moved = delaunay_alloc(&m, 26, mb);
        spare = delaunay_alloc(&m, 30, mb);
        CHECK(vertices && tets && moved && spare);
        delaunay_release(&m, moved);
        delaunay_release(&m, spare);
        delaunay_release(&m, vertices);
        delaunay_release(&m, tets);
        CHECK(m.bytes == 0);
        if (i == 2) before = pages_of_process();
    }
    CHECK(pages_of_process() < before + (64 << 20) / 4096);
}
#endif

static double constant_quality(void *user, const double *a, const double *b, const double *c,
                               const double *d)
{
    (void)user, (void)a, (void)b, (void)c, (void)d;
    return 1;
}

/* The stamps and the numbers of searches overflow: what older ones have left does not count then,
 * although it has the stamps that come again. */
static void stamps_overflow(void)
{
    static const double octahedron[18] = {-20, 0,  0, 20, 0, 0,   0, -16, 0,
                                          0,   16, 0, 0,  0, -12, 0, 0,   12};
    delaunay_mesh m = {0};
    static delaunay_window window;
    static delaunay_search search;
    delaunay_worker *w;
    delaunay_list star;
    uint32_t v[16];
    size_t count = 0, i;
    int round;
    CHECK(delaunay_tetrahedralize(&m, octahedron, 6, NULL, NULL) == DELAUNAY_OK);
    CHECK(delaunay_count_tets(&m) == 4);
    w = delaunay_worker_new(&m.memory);
    memset(&star, 0, sizeof star);
    star.memory = &m.memory;
    for (round = 0; round < 2; round++) { /* the four tetrahedra, replaced by themselves */
        delaunay_handle t, old[4], slots[4];
        for (t = 1, i = 0; t < m.num_tets && i < 4; t++)
            if (!delaunay_is_deleted(&m, t) && !delaunay_is_ghost(&m, t)) old[i++] = t;
        for (i = 0; i < 16; i++) v[i] = m.tets[old[i / 4]].v[i % 4];
        star.count = 0;
        CHECK(delaunay_edge_star(&m, w, old[0], v[0], v[1], &star) == DELAUNAY_OK);
        CHECK(star.count >= 3 && (round == 0 || star.count == count));
        count = star.count;
        w->face_stamp = round ? UINT32_MAX : 0;
        CHECK(delaunay_replace(&m, w, old, 4, v, 4, slots) == DELAUNAY_OK);
        CHECK(w->face_stamp == 1);
        w->set_stamp = UINT32_MAX;
        CHECK(delaunay_validate(&m, DELAUNAY_VALIDATE_DELAUNAY, NULL) == DELAUNAY_OK);
        CHECK(delaunay_window_set(&window, &m, slots, 4, 32, 1, 1));
    }
    for (round = 0; round < 2; round++) { /* the first one ends with nothing better to be found */
        memset(&search, 0, sizeof search);
        search.objective = DELAUNAY_BEST_QUALITY;
        search.quality = constant_quality;
        CHECK(delaunay_reconnect(&m, w, &window, &search) == 1 && search.num_tets == 4);
        CHECK(w->tables->search == 1);
        w->tables->search = UINT32_MAX / 2;
    }
    delaunay_list_free(&star);
    delaunay_worker_free(w);
    delaunay_mesh_free(&m);
}

int main(void)
{
    CHECK(delaunay_selftest() == DELAUNAY_OK);
#if defined(HEAP_IS_GLIBCS)
    freed_blocks_are_used_again();
#endif
    results_have_sentences();
    small_lattices();
    all_kinds_are_delaunay();
    order_of_the_input_does_not_matter();
    threads_do_not_matter();
    any_order_is_the_same_set();
    memory_is_counted();
    grids_with_residues();
    few_and_flat_points();
    wrong_arguments_leave_the_mesh();
    duplicates_map_to_the_first();
    any_allocation_may_fail();
    any_allocation_of_threads_may_fail();
    canonical_order_forgets_the_slots();
    import_and_validate();
    exported_vertices_are_numbered_in_order();
    levels_beyond_the_last_are_the_last();
    cancelled_leaves_nothing();
    cancelled_at_any_time();
    progress_comes_to_one();
    three_points_of_a_plane();
#if defined(DELAUNAY__AVX2)
    vector_signs_are_exact();
#  if defined(DELAUNAY__DIG)
    if (DELAUNAY__AVX2) digging_is_searching();
#  endif
#endif
    plain_cavities_are_cavities();
    canonical_order_may_lack_memory();
    stamps_overflow();
    return check_report();
}
