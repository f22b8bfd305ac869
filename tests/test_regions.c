/* test_regions.c - mesher_color on meshes made by the program: blocks of voxels, each of six
 * tetrahedra, with random labels. The cells, their nesting, winding numbers and volumes are
 * compared with those found by counting voxels. */
#define MESHER_IMPLEMENTATION
#define MESHER__INTERVAL 37 /* many pieces of each cell */
#include "mesher.h"
#include "check.h"
#include <stdlib.h>
#include <string.h>

enum {
    SIDE = 6,
    POINTS = SIDE + 1,
    VOXELS = SIDE * SIDE * SIDE,
    LATTICE = POINTS * POINTS * POINTS,
    TETS = 6 * VOXELS
};

static uint64_t seed_state = 88172645463325252u;
static uint32_t random_below(uint32_t n)
{
    seed_state ^= seed_state << 13;
    seed_state ^= seed_state >> 7;
    seed_state ^= seed_state << 17;
    return (uint32_t)((seed_state >> 20) % n);
}

typedef struct block {
    int label[VOXELS]; /* winding number that the surface gives to it; 0 in the outermost layer */
    int      cell[VOXELS];        /* component, 0: the outside */
    int      num_cells, depth[VOXELS], size[VOXELS], winding[VOXELS];
    uint32_t tets[TETS][4];       /* lattice points */
    double   xyz[3 * LATTICE];    /* of the input vertices */
    uint32_t id[LATTICE];         /* input vertex of a lattice point, or NO_ID */
    uint32_t num_vertices;
    uint32_t triangles[3 * 40000];
    size_t   num_triangles;
    uint64_t sheets, outside_sheets;
} block;

static int point_at(int x, int y, int z) { return (z * POINTS + y) * POINTS + x; }
static int voxel_at(int x, int y, int z) { return (z * SIDE + y) * SIDE + x; }
static int inside_lattice(int p)
{
    int x = p % POINTS, y = p / POINTS % POINTS, z = p / POINTS / POINTS;
    return x > 0 && x < SIDE && y > 0 && y < SIDE && z > 0 && z < SIDE;
}

/* Kuhn's six: all paths along the axes from one corner of the voxel to the opposite one. */
static void cut_voxels(block *b)
{
    static const int orders[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2},
                                     {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
    int v, k, i;
    for (v = 0; v < VOXELS; v++)
        for (k = 0; k < 6; k++) {
            int c[3];
            uint32_t *t = b->tets[6 * v + k];
            c[0] = v % SIDE;
            c[1] = v / SIDE % SIDE;
            c[2] = v / SIDE / SIDE;
            for (i = 0; i < 4; i++) {
                t[i] = (uint32_t)point_at(c[0], c[1], c[2]);
                if (i < 3) c[orders[k][i]]++;
            }
            if (k == 1 || k == 2 || k == 5) { /* odd orders are negative */
                uint32_t s = t[0];
                t[0] = t[1];
                t[1] = s;
            }
        }
}

static int neighbour(int v, int side)
{
    int c[3], axis = side / 2, step = side & 1 ? 1 : -1;
    c[0] = v % SIDE;
    c[1] = v / SIDE % SIDE;
    c[2] = v / SIDE / SIDE;
    c[axis] += step;
    return c[axis] < 0 || c[axis] >= SIDE ? -1 : voxel_at(c[0], c[1], c[2]);
}

static void random_labels(block *b, int materials)
{
    int v, i, x, y, z;
    for (v = 0; v < VOXELS; v++) {
        x = v % SIDE;
        y = v / SIDE % SIDE;
        z = v / SIDE / SIDE;
        b->label[v] = 0;
        if (x == 0 || y == 0 || z == 0 || x == SIDE - 1 || y == SIDE - 1 || z == SIDE - 1) continue;
        b->label[v] =
            materials == 0
                ? (x > 1 && x < 4 && y > 1 && y < 4 && z > 1 && z < 4 ? 0 : 1) /* a hollow cube */
                : (int)random_below((uint32_t)materials) - (materials > 3);
        for (i = 0; materials == 2 && i < 6; i++) /* larger pieces */
            if (neighbour(v, i) >= 0 && neighbour(v, i) < v && random_below(3) == 0)
                b->label[v] = b->label[neighbour(v, i)];
    }
}

/* Components of equal labels, their distance from the outside, all on voxels. */
static void count_cells(block *b)
{
    static int queue[VOXELS];
    int v, head, tail, i, changed;
    for (v = 0; v < VOXELS; v++) b->cell[v] = -1;
    b->num_cells = 0;
    for (v = 0; v < VOXELS; v++) {
        if (b->cell[v] >= 0) continue;
        head = tail = 0;
        queue[tail++] = v;
        b->cell[v] = b->num_cells;
        while (head < tail)
            for (i = 0; i < 6; i++) {
                int w = neighbour(queue[head], i);
                if (w >= 0 && b->cell[w] < 0 && b->label[w] == b->label[v]) {
                    b->cell[w] = b->num_cells;
                    queue[tail++] = w;
                }
                if (i == 5) { head++; break; }
            }
        b->size[b->num_cells] = tail;
        b->winding[b->num_cells] = b->label[v];
        b->depth[b->num_cells++] = v == 0 ? 0 : 1 << 20;
    }
    do {
        changed = 0;
        for (v = 0; v < VOXELS; v++)
            for (i = 0; i < 6; i++) {
                int w = neighbour(v, i);
                if (w < 0 || b->cell[w] == b->cell[v] ||
                    b->depth[b->cell[v]] <= b->depth[b->cell[w]] + 1)
                    continue;
                b->depth[b->cell[v]] = b->depth[b->cell[w]] + 1;
                changed = 1;
            }
    } while (changed);
}

/* The two triangles between voxel v and its neighbour, looking out of v. */
static void face_triangles(const block *b, int v, int w, uint32_t out[2][3])
{
    int k, i, n = 0, j;
    for (k = 0; k < 6; k++)
        for (i = 0; i < 4; i++) {
            const uint8_t *o = delaunay_facet_order(i);
            int shared = 1;
            for (j = 0; j < 3; j++) { /* a corner of w as well */
                int p = (int)b->tets[6 * v + k][o[j]], x = p % POINTS, y = p / POINTS % POINTS,
                    z = p / POINTS / POINTS;
                int wx = w % SIDE, wy = w / SIDE % SIDE, wz = w / SIDE / SIDE;
                if (x < wx || x > wx + 1 || y < wy || y > wy + 1 || z < wz || z > wz + 1)
                    shared = 0;
            }
            if (!shared) continue;
            if (n < 2)
                for (j = 0; j < 3; j++) out[n][j] = b->tets[6 * v + k][o[j]];
            n++;
        }
    CHECK(n == 2);
}

static void add_triangle(block *b, const uint32_t *t, int turned)
{
    uint32_t *out = b->triangles + 3 * b->num_triangles++;
    uint32_t r = random_below(3);
    int j;
    for (j = 0; j < 3; j++) out[j] = b->id[t[(turned ? 5 - j - (int)r : j + (int)r) % 3]];
}

/* Interfaces, with as many copies as the winding number jumps, in random order; then sheets. */
static void make_surface(block *b, int num_sheets)
{
    int v, w, i, k, n, tries;
    uint32_t faces[2][3];
    b->num_vertices = 0;
    b->num_triangles = 0;
    b->sheets = b->outside_sheets = 0;
    for (v = 0; v < LATTICE; v++) {
        b->id[v] = DELAUNAY_NO_ID;
        if (!inside_lattice(v)) continue;
        b->xyz[3 * b->num_vertices] = v % POINTS;
        b->xyz[3 * b->num_vertices + 1] = v / POINTS % POINTS;
        b->xyz[3 * b->num_vertices + 2] = v / POINTS / POINTS;
        b->id[v] = b->num_vertices++;
    }
    for (v = 0; v < VOXELS; v++)
        for (i = 0; i < 6; i++) {
            w = neighbour(v, i);
            if (w < 0 || b->label[v] <= b->label[w]) continue;
            face_triangles(b, v, w, faces);
            for (k = 0; k < 2; k++)
                for (n = b->label[w]; n < b->label[v]; n++) add_triangle(b, faces[k], 0);
            if (random_below(4) == 0) { /* one more of each way round changes nothing */
                add_triangle(b, faces[0], 0);
                add_triangle(b, faces[0], 1);
            }
        }
    for (tries = 0; num_sheets > 0 && tries < 1000; tries++) {
        v = (int)random_below(VOXELS);
        w = neighbour(v, (int)random_below(6));
        if (w < 0 || b->cell[v] != b->cell[w]) continue;
        face_triangles(b, v, w, faces);
        k = (int)random_below(2);
        if (b->id[faces[k][0]] == DELAUNAY_NO_ID || b->id[faces[k][1]] == DELAUNAY_NO_ID ||
            b->id[faces[k][2]] == DELAUNAY_NO_ID)
            continue;
        add_triangle(b, faces[k], (int)random_below(2));
        if (b->cell[v]) b->sheets++;
        else b->outside_sheets++;
        num_sheets--;
    }
    for (n = (int)b->num_triangles; n > 1; n--) { /* shuffle */
        uint32_t j = random_below((uint32_t)n), t[3];
        memcpy(t, b->triangles + 3 * j, sizeof t);
        memcpy(b->triangles + 3 * j, b->triangles + 3 * (n - 1), sizeof t);
        memcpy(b->triangles + 3 * (n - 1), t, sizeof t);
    }
}

typedef struct half { uint32_t v[3]; delaunay_handle f; } half;
static int compare_halves(const void *p, const void *q)
{
    return memcmp(((const half *)p)->v, ((const half *)q)->v, 12);
}
static int compare_u32(const void *p, const void *q)
{
    uint32_t a = *(const uint32_t *)p, b = *(const uint32_t *)q;
    return a < b ? -1 : a > b;
}

/* Whether a facet of the lattice is one of the surface. */
static int is_surface(const block *b, const mesher_domain *domain, const uint32_t *v)
{
    uint32_t ids[3], f;
    int k;
    for (k = 0; k < 3; k++) {
        ids[k] = b->id[v[k] - 1];
        if (ids[k] == DELAUNAY_NO_ID) return 0;
    }
    qsort(ids, 3, sizeof ids[0], compare_u32);
    for (f = 0; f < domain->num_facets; f++)
        if (memcmp(domain->facets + 3 * f, ids, sizeof ids) == 0) return 1;
    return 0;
}

/* The vertices of the domain's mesh, in the lattice's order behind the ghost. */
static int make_vertices(const block *b, mesher_domain *domain)
{
    delaunay_mesh *mesh = &domain->mesh;
    size_t i;
    mesh->num_points = domain->first_corner + 8;
    mesh->vertex_of =
        (uint32_t *)delaunay_alloc(&mesh->memory, mesh->num_points, sizeof *mesh->vertex_of);
    if (!mesh->vertex_of) return 0;
    for (i = 0; i < LATTICE; i++) {
        int x = (int)i % POINTS, y = (int)i / POINTS % POINTS, z = (int)i / POINTS / POINTS;
        double xyz[3];
        uint32_t id = b->id[i];
        xyz[0] = x;
        xyz[1] = y;
        xyz[2] = z;
        if (x % SIDE == 0 && y % SIDE == 0 && z % SIDE == 0)
            id = domain->first_corner + (uint32_t)(x / SIDE + y / SIDE * 2 + z / SIDE * 4);
        if (delaunay_add_vertex(mesh, xyz, id) != i + 1) return 0;
        if (id != DELAUNAY_NO_ID) mesh->vertex_of[id] = (uint32_t)i + 1;
    }
    return 1;
}

/* The domain's mesh from the block; neighbours by sorting. */
static int make_mesh(const block *b, mesher_domain *domain)
{
    static half halves[4 * TETS];
    delaunay_mesh *mesh = &domain->mesh;
    size_t i, n = 0;
    int j, k;
    if (delaunay_memory_init(&mesh->memory, NULL) != DELAUNAY_OK) return 0;
    if (delaunay_reserve(mesh, LATTICE + 1, TETS + 1) != DELAUNAY_OK) return 0;
    if (!make_vertices(b, domain)) return 0;
    for (i = 0; i < TETS; i++) {
        delaunay_tet *t = mesh->tets + i + 1;
        memset(t, 0, sizeof *t);
        for (j = 0; j < 4; j++) t->v[j] = b->tets[i][j] + 1;
        for (j = 0; j < 4; j++) {
            half *h = halves + n++;
            for (k = 0; k < 3; k++) h->v[k] = t->v[delaunay_facet_order(j)[k]];
            qsort(h->v, 3, sizeof h->v[0], compare_u32);
            h->f = (delaunay_handle)(4 * (i + 1)) + (delaunay_handle)j;
        }
    }
    mesh->num_tets = TETS + 1;
    if (delaunay_enable_marks(mesh) != DELAUNAY_OK) return 0;
    qsort(halves, n, sizeof *halves, compare_halves);
    for (i = 0; i + 1 < n; i++) {
        delaunay_handle f = halves[i].f, g = halves[i + 1].f;
        if (compare_halves(halves + i, halves + i + 1) != 0) continue;
        mesh->tets[f / 4].n[f % 4] = g;
        mesh->tets[g / 4].n[g % 4] = f;
        if (is_surface(b, domain, halves[i].v)) {
            mesh->flags[f / 4] = (uint16_t)(mesh->flags[f / 4] | DELAUNAY_FACET_BIT(f % 4));
            mesh->flags[g / 4] = (uint16_t)(mesh->flags[g / 4] | DELAUNAY_FACET_BIT(g % 4));
        }
    }
    return 1;
}

static int expected_kept(const block *b, int cell, mesher_regions policy)
{
    if (policy == MESHER_REGIONS_PARITY) return b->depth[cell] & 1;
    if (policy == MESHER_REGIONS_WINDING) return b->winding[cell] != 0;
    return 1;
}

/* The cell that a triangle's back looks at. */
static int cell_behind(const block *b, uint32_t triangle)
{
    const double *p[3];
    double n[3], x[3];
    int i, j;
    for (i = 0; i < 3; i++) p[i] = b->xyz + 3 * b->triangles[3 * triangle + (uint32_t)i];
    for (i = 0; i < 3; i++) {
        int k = (i + 1) % 3, l = (i + 2) % 3;
        n[i] =
            (p[1][k] - p[0][k]) * (p[2][l] - p[0][l]) - (p[1][l] - p[0][l]) * (p[2][k] - p[0][k]);
        for (x[i] = 0, j = 0; j < 3; j++) x[i] += p[j][i] / 3;
        x[i] -= n[i] / 4; /* the normal has length 1 */
    }
    return b->cell[voxel_at((int)x[0], (int)x[1], (int)x[2])];
}

/* Everything that mesher_color says, against the voxels. */
static void compare(const block *b, const mesher_domain *domain, const mesher_report *report,
                    mesher_regions policy)
{
    static int cell_of[VOXELS + 1];
    uint32_t color_of[VOXELS], i, kept = 0;
    int v, bad = 0;
    double total = 0;
    for (v = 0; v < VOXELS; v++) color_of[v] = DELAUNAY_NO_ID;
    for (i = 0; i < TETS; i++) { /* one colour a cell; a region's number says which cell it is */
        int c = b->cell[i / 6];
        uint32_t color = domain->mesh.color[i + 1];
        if (color_of[c] == DELAUNAY_NO_ID) color_of[c] = color;
        if (color_of[c] != color) bad++;
        if (c == 0 && color != DELAUNAY_OUTSIDE) bad++;
    }
    CHECK(bad == 0);
    CHECK((int)domain->num_regions == b->num_cells - 1);
    for (v = 0; v <= VOXELS; v++) cell_of[v] = -1;
    for (v = 1; v < b->num_cells; v++)
        if (color_of[v] != DELAUNAY_OUTSIDE) {
            CHECK(color_of[v] <= VOXELS && cell_of[color_of[v]] == -1);
            if (color_of[v] <= VOXELS) cell_of[color_of[v]] = v;
        }
    for (i = 0; i < domain->num_regions; i++) {
        const mesher_region *r = domain->regions + i;
        total += r->volume;
        if (i) CHECK(r[-1].first_facet <= r->first_facet);
        kept += r->kept != 0;
        CHECK(r->kept ? r->number == kept : r->number == 0);
        if (!r->kept) continue;
        v = cell_of[r->number];
        CHECK(v > 0);
        if (v <= 0) continue;
        CHECK(fabs(r->volume - b->size[v]) < 1e-9 && r->num_tets == 6 * (uint64_t)b->size[v]);
        CHECK((int)r->depth == b->depth[v]);
        CHECK(r->winding == b->winding[v]);
        CHECK(expected_kept(b, v, policy));
        if (i && r[-1].kept && r[-1].first_facet == r->first_facet)
            CHECK(cell_of[r[-1].number] == cell_behind(b, r->first_facet));
    }
    for (v = 1, i = 0; v < b->num_cells; v++) i += expected_kept(b, v, policy) != 0;
    CHECK(kept == i && report->num_regions == kept);
    CHECK(fabs(total - (VOXELS - b->size[0])) < 1e-9);
    CHECK(report->counts[MESHER_NOTE_SHEET] <= b->sheets &&
          (report->counts[MESHER_NOTE_SHEET] > 0) == (b->sheets > 0));
    CHECK((report->counts[MESHER_DEFECT_OUTSIDE_FACET] > 0) == (b->outside_sheets > 0));
}

static void random_blocks(void)
{
    static block b;
    int round;
    cut_voxels(&b);
    for (round = 0; round < 60; round++) {
        mesher_surface surface;
        mesher_domain domain;
        mesher_options options;
        mesher_report report;
        mesher_result result;
        random_labels(&b, round % 4 == 3 ? 0 : 2 + round % 4);
        count_cells(&b);
        make_surface(&b, round % 2 ? (int)random_below(4) : 0);
        if (b.num_cells == 1) continue;
        memset(&surface, 0, sizeof surface);
        memset(&report, 0, sizeof report);
        memset(&options, 0, sizeof options);
        surface.xyz = b.xyz;
        surface.num_vertices = b.num_vertices;
        surface.triangles = b.triangles;
        surface.num_triangles = b.num_triangles;
        options.regions = (mesher_regions)(round % 3);
        result = mesher_domain_init(&domain, &surface, &options, &report);
        CHECK(result == MESHER_OK);
        if (result != MESHER_OK) continue;
        CHECK(make_mesh(&b, &domain));
        result = mesher_color(&domain, &report);
        CHECK(result == (b.outside_sheets ? MESHER_ERROR_SURFACE : MESHER_OK));
        compare(&b, &domain, &report, options.regions);
        mesher_domain_free(&domain);
    }
}

/* A hollow cube: the void is filled with a note, or not. */
static void a_void_is_noted(void)
{
    static block b;
    int policy;
    cut_voxels(&b);
    random_labels(&b, 0);
    count_cells(&b);
    CHECK(b.num_cells == 3 && b.size[2] == 8);
    for (policy = 0; policy < 3; policy++) {
        mesher_surface surface;
        mesher_domain domain;
        mesher_options options;
        mesher_report report;
        make_surface(&b, 0);
        memset(&surface, 0, sizeof surface);
        memset(&report, 0, sizeof report);
        memset(&options, 0, sizeof options);
        surface.xyz = b.xyz;
        surface.num_vertices = b.num_vertices;
        surface.triangles = b.triangles;
        surface.num_triangles = b.num_triangles;
        options.regions = (mesher_regions)policy;
        CHECK(mesher_domain_init(&domain, &surface, &options, &report) == MESHER_OK);
        CHECK(make_mesh(&b, &domain));
        CHECK(mesher_color(&domain, &report) == MESHER_OK);
        CHECK(report.counts[MESHER_NOTE_SHELL_FILLED] == (policy == 0));
        CHECK(report.num_regions == (policy == 0 ? 2u : 1u));
        mesher_domain_free(&domain);
    }
}

static void seeds_choose(void)
{
    static block b;
    int round;
    cut_voxels(&b);
    for (round = 0; round < 20; round++) {
        mesher_surface surface;
        mesher_domain domain;
        mesher_options options;
        mesher_report report;
        double seeds[9];
        int32_t tags[3], wanted[VOXELS];
        int i, j, any = 0, bad = 0, kept = 0, counted[VOXELS] = {0};
        uint64_t outside = 0, shared = 0, unseeded = 0;
        random_labels(&b, 2 + round % 3);
        count_cells(&b);
        make_surface(&b, 0);
        if (b.num_cells < 3) continue;
        for (i = 0; i < VOXELS; i++) wanted[i] = -1;
        for (i = 0; i < 3; i++) {
            int v = (int)random_below(VOXELS);
            seeds[3 * i] = v % SIDE + 0.375; /* in the interior of one of the six */
            seeds[3 * i + 1] = v / SIDE % SIDE + 0.25;
            seeds[3 * i + 2] = v / SIDE / SIDE + 0.625;
            tags[i] = round % 4 == 0 ? 0 : (int32_t)(random_below(3) * 5);
            any |= tags[i] > 0;
            if (wanted[b.cell[v]] < 0) wanted[b.cell[v]] = tags[i];
            shared += b.cell[v] && wanted[b.cell[v]] != tags[i];
            outside += b.cell[v] == 0;
        }
        memset(&surface, 0, sizeof surface);
        memset(&report, 0, sizeof report);
        memset(&options, 0, sizeof options);
        surface.xyz = b.xyz;
        surface.num_vertices = b.num_vertices;
        surface.triangles = b.triangles;
        surface.num_triangles = b.num_triangles;
        surface.seeds = seeds;
        surface.seed_tags = tags;
        surface.num_seeds = 3;
        options.regions = MESHER_REGIONS_SEEDS;
        CHECK(mesher_domain_init(&domain, &surface, &options, &report) == MESHER_OK);
        CHECK(make_mesh(&b, &domain));
        CHECK(delaunay_link_vertices(&domain.mesh) == DELAUNAY_OK);
        for (i = 0; i < VOXELS; i++)
            kept |= b.cell[i] && (any ? wanted[b.cell[i]] > 0 : wanted[b.cell[i]] != 0);
        CHECK(mesher_color(&domain, &report) == (kept ? MESHER_OK : MESHER_ERROR_SURFACE));
        for (i = 0; i < VOXELS && any && kept; i++) {
            unseeded += b.cell[i] && wanted[b.cell[i]] < 0 && !counted[b.cell[i]];
            counted[b.cell[i]] = 1;
        }
        CHECK(report.counts[MESHER_NOTE_OUTSIDE_SEED] == outside);
        CHECK(report.counts[MESHER_NOTE_SHARED_CELL] == shared);
        CHECK(report.counts[MESHER_NOTE_UNSEEDED_CELL] == unseeded);
        CHECK(report.counts[MESHER_DEFECT_NONE_KEPT] == !kept);
        for (j = 0; j < TETS && kept; j++) {
            int c = b.cell[j / 6];
            uint32_t color = domain.mesh.color[j + 1];
            if (c == 0) bad += color != 0;
            else if (any) bad += color != (wanted[c] > 0 ? (uint32_t)wanted[c] : 0u);
            else bad += (color != 0) != (wanted[c] != 0);
        }
        CHECK(bad == 0);
        mesher_domain_free(&domain);
    }
}

/* What a user reads whose only seed lies beside the body. */
static void a_seed_outside_is_named(void)
{
    static const uint32_t triangles[12] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2};
    static const double xyz[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
    const double seed[3] = {2, 3, 4};
    mesher_surface surface;
    mesher_domain domain;
    mesher_options options;
    mesher_report report;
    mesher_finding findings[4];
    char text[200];
    memset(&surface, 0, sizeof surface);
    memset(&report, 0, sizeof report);
    memset(&options, 0, sizeof options);
    surface.xyz = xyz;
    surface.num_vertices = 4;
    surface.triangles = triangles;
    surface.num_triangles = 4;
    surface.seeds = seed;
    surface.num_seeds = 1;
    options.regions = MESHER_REGIONS_SEEDS;
    report.findings = findings;
    report.cap_findings = 4;
    CHECK(mesher_mesh(&domain, &surface, &options, &report) == MESHER_ERROR_SURFACE);
    CHECK(strstr(report.message, "choice of regions") != NULL);
    CHECK(report.num_findings == 2 && findings[1].kind == MESHER_NOTE_OUTSIDE_SEED);
    mesher_finding_string(text, sizeof text, &report, &findings[1]);
    CHECK(strcmp(text, "seed 0 at (2, 3, 4) is in no bounded cell") == 0);
    mesher_domain_free(&domain);
}

/* What a user reads who has put both seeds into the same one of two bodies. */
static void cells_without_a_seed_are_named(void)
{
    static const uint32_t triangles[24] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2,
                                           4, 6, 5, 4, 5, 7, 5, 6, 7, 4, 7, 6};
    static const double xyz[24] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1,
                                   5, 0, 0, 6, 0, 0, 5, 1, 0, 5, 0, 1};
    const double seeds[6] = {0.25, 0.25, 0.25, 0.125, 0.25, 0.25};
    mesher_surface surface;
    mesher_domain domain;
    mesher_options options;
    mesher_report report;
    mesher_finding findings[4];
    char text[200];
    memset(&surface, 0, sizeof surface);
    memset(&report, 0, sizeof report);
    memset(&options, 0, sizeof options);
    surface.xyz = xyz;
    surface.num_vertices = 8;
    surface.triangles = triangles;
    surface.num_triangles = 8;
    surface.seeds = seeds;
    surface.num_seeds = 2;
    options.regions = MESHER_REGIONS_SEEDS;
    report.findings = findings;
    report.cap_findings = 4;
    CHECK(mesher_mesh(&domain, &surface, &options, &report) == MESHER_OK);
    CHECK(report.num_regions == 1 && report.num_findings == 2);
    mesher_finding_string(text, sizeof text, &report, &findings[0]);
    CHECK(strcmp(text, "seed 1 at (0.125, 0.25, 0.25) is in the cell of seed 0, whose number it "
                       "gets") == 0);
    mesher_finding_string(text, sizeof text, &report, &findings[1]);
    CHECK(strcmp(text, "a cell at triangle 4 has no seed and is left out, as others have one") ==
          0);
    mesher_domain_free(&domain);
}

int main(void)
{
    random_blocks();
    a_void_is_noted();
    seeds_choose();
    a_seed_outside_is_named();
    cells_without_a_seed_are_named();
    return check_report();
}
