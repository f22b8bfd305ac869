/* Sizes and refinement: the mesh conforms to the wanted size, no vertices are too close, surface
 * and lines stay intact; budgets, size functions of every kind, the same bytes for any number of
 * threads. */
#ifndef LINKED
#  define MESHER_IMPLEMENTATION
#endif
#include "mesher.h"
#define MESHIO_IMPLEMENTATION
#include "meshio.h"
#include "demo_part.h"
#include "check.h"
#include "small_mesh.h"
#include "shapes.h"

/* A box of n[0] x n[1] x n[2] cubes of the given edge, each of six tetrahedra; its faces are the
 * surface. */
static int box_domain(mesher_domain *domain, const int *n, double edge,
                      const mesher_options *options)
{
    static const int path[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2},
                                   {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
    uint32_t np = (uint32_t)((n[0] + 1) * (n[1] + 1) * (n[2] + 1)), nt = 0, i;
    double *xyz = (double *)malloc(np * 3 * sizeof *xyz);
    uint32_t *tets = (uint32_t *)malloc((size_t)(n[0] * n[1] * n[2]) * 24 * sizeof *tets);
    int c[3], p, k, ok;
    for (i = 0; i < np; i++) {
        xyz[3 * i] = edge * (int)(i % (uint32_t)(n[0] + 1));
        xyz[3 * i + 1] = edge * (int)(i / (uint32_t)(n[0] + 1) % (uint32_t)(n[1] + 1));
        xyz[3 * i + 2] = edge * (int)(i / (uint32_t)((n[0] + 1) * (n[1] + 1)));
    }
    for (c[2] = 0; c[2] < n[2]; c[2]++)
        for (c[1] = 0; c[1] < n[1]; c[1]++)
            for (c[0] = 0; c[0] < n[0]; c[0]++)
                for (p = 0; p < 6; p++) {
                    int at[3];
                    memcpy(at, c, sizeof at);
                    for (k = 0; k < 4; k++) {
                        tets[4 * nt + (uint32_t)k] =
                            (uint32_t)(at[0] + (n[0] + 1) * (at[1] + (n[1] + 1) * at[2]));
                        if (k < 3) at[path[p][k]]++;
                    }
                    nt++;
                }
    memset(domain, 0, sizeof *domain);
    ok = mesher_options_resolve(&domain->options, options) == MESHER_OK &&
         delaunay_memory_init(&domain->memory, &domain->options.host) == DELAUNAY_OK &&
         small_mesh(&domain->mesh, &domain->options.host, xyz, np, tets, nt, 0);
    domain->first_corner = np;
    free(xyz);
    free(tets);
    return ok;
}

/* Marks all facets on one tetrahedron or between two colours, and their edges. */
static int constrain(mesher_domain *domain)
{
    delaunay_mesh *m = &domain->mesh;
    delaunay_worker *w = delaunay_worker_new(&m->memory);
    delaunay_handle t;
    uint32_t i, n = 0;
    int k;
    if (!w) return 0;
    domain->edges = (uint32_t *)delaunay_alloc(&domain->memory, (size_t)m->num_tets * 24,
                                               sizeof *domain->edges);
    m->vertex_of = (uint32_t *)delaunay_alloc(&m->memory, m->num_vertices, sizeof *m->vertex_of);
    if (!domain->edges || !m->vertex_of) return 0;
    m->num_points = m->num_vertices - 1;
    for (i = 0; i < m->num_points; i++) m->vertex_of[i] = i + 1;
    for (t = 1; t < m->num_tets; t++)
        for (k = 0; k < 4; k++) {
            delaunay_handle u = m->tets[t].n[k] >> 2;
            const uint8_t *f = delaunay_facet_order(k);
            if (u && m->color[u] == m->color[t]) continue;
            delaunay_mark_facet(m, 4 * t + (delaunay_handle)k, 1);
            for (i = 0; i < 3; i++)
                if (delaunay_mark_edge(m, w, t, m->tets[t].v[f[i]], m->tets[t].v[f[(i + 1) % 3]],
                                       1) != DELAUNAY_OK)
                    return 0;
        }
    for (t = 1; t < m->num_tets; t++)
        for (k = 0; k < 6; k++) {
            uint32_t a = m->tets[t].v[delaunay_edge_order(k)[0]],
                     b = m->tets[t].v[delaunay_edge_order(k)[1]];
            if (!(m->flags[t] & DELAUNAY_EDGE_BIT(k))) continue;
            if (a > b) { i = a; a = b; b = i; }
            for (i = 0;
                 i < n && (domain->edges[2 * i] != a - 1 || domain->edges[2 * i + 1] != b - 1);
                 i++) {}
            if (i < n) continue;
            domain->edges[2 * n] = a - 1;
            domain->edges[2 * n++ + 1] = b - 1;
        }
    domain->num_edges = n;
    delaunay_worker_free(w);
    return 1;
}

static void paint(mesher_domain *domain, double split_x)
{
    delaunay_handle t;
    for (t = 1; t < domain->mesh.num_tets; t++) {
        double x = 0;
        int i;
        for (i = 0; i < 4; i++) x += domain->mesh.vertices[domain->mesh.tets[t].v[i]].x[0] / 4;
        domain->mesh.color[t] = x < split_x ? 1 : 2;
    }
}

static int box(mesher_domain *domain, int nx, int ny, int nz, double edge, double split,
               const mesher_options *options)
{
    int n[3];
    n[0] = nx;
    n[1] = ny;
    n[2] = nz;
    if (!box_domain(domain, n, edge, options)) return 0;
    paint(domain, split);
    return constrain(domain);
}

/* A number for the constrained facets with their colours, whatever their slots. */
static uint64_t surface_hash(const mesher_domain *domain)
{
    const delaunay_mesh *m = &domain->mesh;
    uint64_t sum = 0, h;
    delaunay_handle t;
    uint32_t v[3];
    int i;
    for (t = 1; t < m->num_tets; t++)
        for (i = 0; i < 4 && !delaunay_is_deleted(m, t); i++) {
            if (!(m->flags[t] & DELAUNAY_FACET_BIT(i))) continue;
            small_facet(m, 4 * t + (delaunay_handle)i, v);
            h = (uint64_t)small_sort3(v) + 7919 * m->color[t];
            h = h * 1000003 + v[0];
            h = h * 1000003 + v[1];
            h = h * 1000003 + v[2];
            sum += (h ^ (h >> 31)) * 0x9e3779b97f4a7c15u;
        }
    return sum;
}

static uint64_t mesh_hash(const mesher_domain *domain)
{
    const delaunay_mesh *m = &domain->mesh;
    const unsigned char *p = (const unsigned char *)m->tets;
    uint64_t h = 14695981039346656037u;
    size_t i;
    for (i = 0; i < m->num_tets * sizeof *m->tets; i++) h = (h ^ p[i]) * 1099511628211u;
    for (i = 0; i < m->num_vertices; i++) {
        uint64_t bits[3];
        memcpy(bits, m->vertices[i].x, sizeof bits);
        h = (h ^ bits[0] ^ (bits[1] * 3) ^ (bits[2] * 5)) * 1099511628211u;
    }
    return h;
}

/* Smallest distance of two vertices joined by an edge, one of them new, relative to the mean of
 * their sizes. */
static double nearest(const mesher_domain *domain, uint32_t first_new)
{
    const delaunay_mesh *m = &domain->mesh;
    delaunay_handle t;
    double least = 1e300;
    int e;
    for (t = 1; t < m->num_tets; t++)
        for (e = 0; e < 6 && !delaunay_is_deleted(m, t); e++) {
            uint32_t a = m->tets[t].v[delaunay_edge_order(e)[0]],
                     b = m->tets[t].v[delaunay_edge_order(e)[1]];
            double x = m->vertices[a].x[0] - m->vertices[b].x[0],
                   y = m->vertices[a].x[1] - m->vertices[b].x[1];
            double z = m->vertices[a].x[2] - m->vertices[b].x[2];
            double ratio = 2 * sqrt(x * x + y * y + z * z) / (domain->size[a] + domain->size[b]);
            if ((a >= first_new || b >= first_new) && ratio < least) least = ratio;
        }
    return least;
}

static int stage_bits_clear(const mesher_domain *domain)
{
    delaunay_handle t;
    for (t = 1; t < domain->mesh.num_tets; t++)
        if ((domain->mesh.flags[t] & DELAUNAY_STAGE_BITS) || domain->mesh.mark[t]) return 0;
    return 1;
}

/* Sizes, refines, and checks all that must hold whatever the options. */
static mesher_result refine_and_check(mesher_domain *domain, mesher_report *report)
{
    uint64_t surface = surface_hash(domain);
    uint32_t first_new = domain->mesh.num_vertices;
    double volume = small_total(&domain->mesh);
    mesher_result result;
    memset(report, 0, sizeof *report);
    result = mesher_size(domain, report);
    CHECK(result == MESHER_OK);
    if (result == MESHER_OK) result = mesher_refine(domain, report);
    CHECK(small_valid(&domain->mesh));
    CHECK(surface_hash(domain) == surface);
    CHECK(fabs(small_total(&domain->mesh) - volume) <= 1e-10 * volume);
    CHECK(stage_bits_clear(domain));
    CHECK(domain->mesh.num_vertices - first_new == report->refined_vertices);
    CHECK(delaunay_count_tets(&domain->mesh) == report->num_tets);
    if (report->refined_vertices) {
        CHECK(nearest(domain, first_new) > 0.69);
        CHECK(domain->mesh.vertex_id[first_new] == DELAUNAY_NO_ID);
    }
    return result;
}

static void one_cube_gets_the_wanted_size(void)
{
    mesher_domain d;
    mesher_report r;
    mesher_options o;
    memset(&o, 0, sizeof o);
    o.size = 0.08;
    CHECK(box(&d, 1, 1, 1, 1, 9, &o));
    CHECK(refine_and_check(&d, &r) == MESHER_OK);
    CHECK(r.refined_vertices > 500 && r.refined_vertices < 6000);
    CHECK(r.size_p50 > 0.8 && r.size_p50 < 1.25);
    mesher_domain_free(&d);
    o.size = 0;
    CHECK(box(&d, 5, 5, 5, 0.2, 9, &o));
    CHECK(refine_and_check(&d, &r) == MESHER_OK);
    CHECK(r.refined_vertices < 60); /* the lattice has the size that its surface asks for */
    mesher_domain_free(&d);
}

static void a_fine_surface_is_honoured(void)
{
    mesher_domain d;
    mesher_report r;
    mesher_options o;
    memset(&o, 0, sizeof o);
    o.size = 0.05;
    CHECK(box(&d, 6, 6, 6, 0.1, 9, &o));
    CHECK(refine_and_check(&d, &r) == MESHER_OK);
    CHECK(r.size_in_band > 0.85);
    mesher_domain_free(&d);
}

static void a_plate_of_one_layer_gets_no_points(void)
{
    mesher_domain d;
    mesher_report r;
    CHECK(box(&d, 12, 12, 1, 1, 99, NULL));
    CHECK(refine_and_check(&d, &r) == MESHER_OK);
    CHECK(r.refined_vertices == 0);
    mesher_domain_free(&d);
}

static void an_interface_and_its_colours_stay(void)
{
    mesher_domain d;
    mesher_report r;
    mesher_options o;
    delaunay_handle t;
    memset(&o, 0, sizeof o);
    o.size = 0.25;
    CHECK(box(&d, 4, 3, 3, 1, 2, &o));
    CHECK(refine_and_check(&d, &r) == MESHER_OK);
    CHECK(r.refined_vertices > 200);
    for (t = 1; t < d.mesh.num_tets; t++) {
        double x = 0;
        int i;
        if (delaunay_is_deleted(&d.mesh, t)) continue;
        for (i = 0; i < 4; i++) x += d.mesh.vertices[d.mesh.tets[t].v[i]].x[0] / 4;
        CHECK(d.mesh.color[t] == (x < 2 ? 1u : 2u));
    }
    mesher_domain_free(&d);
}

static void outside_is_never_refined(void)
{
    mesher_domain d;
    mesher_report r;
    mesher_options o;
    delaunay_handle t;
    uint32_t v;
    memset(&o, 0, sizeof o);
    o.size = 0.3;
    CHECK(box(&d, 4, 2, 2, 1, 2, &o));
    for (t = 1; t < d.mesh.num_tets; t++)
        if (d.mesh.color[t] == 2) d.mesh.color[t] = DELAUNAY_OUTSIDE;
    memset(&r, 0, sizeof r);
    CHECK(mesher_size(&d, &r) == MESHER_OK && mesher_refine(&d, &r) == MESHER_OK);
    CHECK(small_valid(&d.mesh) && r.refined_vertices > 20);
    for (v = d.mesh.num_points + 1; v < d.mesh.num_vertices; v++)
        CHECK(d.mesh.vertices[v].x[0] < 2);
    mesher_domain_free(&d);
}

/* A line inside, marked on edges of the lattice. */
static void an_embedded_line_stays(void)
{
    mesher_domain d;
    mesher_report r;
    mesher_options o;
    delaunay_worker *w;
    uint32_t i;
    memset(&o, 0, sizeof o);
    o.size = 0.3;
    CHECK(box(&d, 4, 4, 4, 1, 9, &o));
    w = delaunay_worker_new(&d.mesh.memory);
    CHECK(w != NULL);
    for (i = 0; i < 2; i++) {
        uint32_t a = 1 + 2 + 5 * (2 + 5 * (1 + i)), b = a + 25;
        delaunay_handle t = delaunay_find_edge(&d.mesh, w, a, b);
        CHECK(t && delaunay_mark_edge(&d.mesh, w, t, a, b, 1) == DELAUNAY_OK);
    }
    CHECK(refine_and_check(&d, &r) == MESHER_OK);
    for (i = 0; i < 2; i++) {
        uint32_t a = 1 + 2 + 5 * (2 + 5 * (1 + i)), b = a + 25;
        delaunay_handle t = delaunay_find_edge(&d.mesh, w, a, b);
        CHECK(t != 0);
        if (t)
            CHECK(d.mesh.flags[t] & DELAUNAY_EDGE_BIT(delaunay_edge_between(
                                        delaunay_local_index(d.mesh.tets + t, a),
                                        delaunay_local_index(d.mesh.tets + t, b))));
    }
    CHECK(r.refined_vertices > 500);
    delaunay_worker_free(w);
    mesher_domain_free(&d);
}

enum { NAN_WISH, ZERO_WISH, NEGATIVE_WISH, JUMP_WISH, BALL_WISH, TINY_WISH };
static void wish(void *user, size_t count, const double *xyz, const uint32_t *region, double *out)
{
    size_t i;
    double zero = 0;
    (void)region;
    for (i = 0; i < count; i++) {
        double x = xyz[3 * i] - 1.5, y = xyz[3 * i + 1] - 1.5, z = xyz[3 * i + 2] - 1.5;
        double d = sqrt(x * x + y * y + z * z);
        switch (*(int *)user) {
        case NAN_WISH: out[i] = zero / zero; break;
        case ZERO_WISH: out[i] = 0; break;
        case NEGATIVE_WISH: out[i] = -1; break;
        case JUMP_WISH: out[i] = x < 0 ? 0.15 : 0.6; break;
        case BALL_WISH: out[i] = 0.05 + 0.25 * d; break;
        default: out[i] = 1e-30; break;
        }
    }
}

static void size_functions_of_every_kind(void)
{
    int kind;
    uint64_t plain = 0;
    for (kind = NAN_WISH; kind <= TINY_WISH; kind++) {
        mesher_domain d;
        mesher_report r;
        mesher_options o;
        memset(&o, 0, sizeof o);
        o.size = 0.6;
        o.size_function = wish;
        o.size_user = &kind;
        o.max_vertices = 6000;
        CHECK(box(&d, 3, 3, 3, 1, 9, &o));
        CHECK(refine_and_check(&d, &r) ==
              (kind == TINY_WISH ? MESHER_STOPPED_BY_BUDGET : MESHER_OK));
        CHECK((r.size_ignored > 0) == (kind <= NEGATIVE_WISH));
        if (kind == NAN_WISH) plain = mesh_hash(&d);
        if (kind == ZERO_WISH || kind == NEGATIVE_WISH) CHECK(mesh_hash(&d) == plain);
        if (kind == BALL_WISH || kind == JUMP_WISH)
            CHECK(r.refined_vertices > 200 && r.size_in_band > 0.65);
        mesher_domain_free(&d);
    }
}

/* Mean length of the edges with both ends in a box, one end at least not of the input. */
static double mean_edge(const mesher_domain *d, const double *lo, const double *hi)
{
    const delaunay_mesh *m = &d->mesh;
    double sum = 0, count = 0;
    delaunay_handle t;
    int e, k, i;
    for (t = 1; t < m->num_tets; t++)
        for (e = 0; e < 6 && !delaunay_is_deleted(m, t); e++) {
            double l = 0;
            int in = 1;
            uint32_t v[2];
            for (k = 0; k < 2; k++) {
                v[k] = m->tets[t].v[delaunay_edge_order(e)[k]];
                for (i = 0; i < 3; i++)
                    in = in && m->vertices[v[k]].x[i] >= lo[i] && m->vertices[v[k]].x[i] <= hi[i];
            }
            if (!in || (v[0] <= m->num_points && v[1] <= m->num_points)) continue;
            for (i = 0; i < 3; i++) l += pow(m->vertices[v[0]].x[i] - m->vertices[v[1]].x[i], 2);
            sum += sqrt(l);
            count++;
        }
    return count > 0 ? sum / count : 0;
}

static void sources_have_their_sizes(void)
{
    static const double lo[3] = {1.2, 1.2, 1.2}, hi[3] = {1.8, 1.8, 1.8};
    int kind;
    for (kind = 0; kind < 4; kind++) {
        mesher_domain d;
        mesher_report r;
        mesher_options o;
        mesher_source s;
        double near, far;
        int k;
        memset(&o, 0, sizeof o);
        memset(&s, 0, sizeof s);
        s.shape = (mesher_shape)kind;
        s.size = 0.1;
        s.radius = kind == MESHER_SHAPE_BOX ? 0 : 0.55;
        for (k = 0; k < 3; k++) {
            s.xyz[k] = kind == MESHER_SHAPE_BOX ? 1.1 : 1.5;
            s.xyz[3 + k] = kind == MESHER_SHAPE_BOX ? 1.9 : 1.51;
            s.xyz[6 + k] = k == 0 ? 1.6 : 1.5;
        }
        o.sources = &s;
        o.num_sources = 1;
        CHECK(box(&d, 9, 9, 9, 1 / 3.0, 9, &o));
        CHECK(refine_and_check(&d, &r) == MESHER_OK);
        near = mean_edge(&d, lo, hi);
        CHECK(near > 0.08 && near < 0.125);
        CHECK(r.size_in_band > 0.85);
        far = mesher_source_size(&s, 1.4, s.xyz);
        CHECK(far == 0.1);
        mesher_domain_free(&d);
    }
}

static void distances_to_shapes(void)
{
    static const double at[4][3] = {{3, 0, 0}, {0, 2, 5}, {-1, -1, 0}, {0.25, 0.25, -2}};
    static const double expected[4][4] = {
        {3, 2, 2, 2},
        {5.385164807134504, 4.123105625617661, 5.385164807134504, 5.099019513592785},
        {1.4142135623730951, 1.4142135623730951, 1.4142135623730951, 1.4142135623730951},
        {2.0310096011589902, 2, 2.0155644370746373, 2}};
    int kind, k, i;
    for (kind = 0; kind < 4; kind++)
        for (k = 0; k < 4; k++) {
            mesher_source s;
            memset(&s, 0, sizeof s);
            s.shape = (mesher_shape)kind;
            s.size = 1;
            s.slope = 1;
            s.xyz[3] = 1; /* x axis, and the triangle (0,0,0) (1,0,0) (0,1,0); the unit box */
            s.xyz[4] = s.xyz[5] = kind == MESHER_SHAPE_BOX;
            s.xyz[7] = 1;
            CHECK(fabs(mesher_source_size(&s, 0, at[k]) - 1 - expected[k][kind]) < 1e-12);
            for (i = 0; i < 3 && kind == MESHER_SHAPE_BOX; i++) { /* between any opposite corners */
                s.xyz[i] = 1;
                s.xyz[3 + i] = 0;
                CHECK(fabs(mesher_source_size(&s, 0, at[k]) - 1 - expected[k][kind]) < 1e-12);
            }
        }
}

static void regions_and_vertices_have_their_sizes(void)
{
    static const double sizes[2] = {0, 0.2}, lo[3] = {2.3, 0.2, 0.2}, hi[3] = {3.7, 1.8, 1.8};
    static const double left_lo[3] = {0, 0, 0}, left_hi[3] = {1.4, 2, 2};
    double wish[5 * 3 * 3], fine, coarse;
    mesher_domain d;
    mesher_report r;
    mesher_options o;
    int i;
    memset(&o, 0, sizeof o);
    o.size = 0.6;
    o.region_sizes = sizes;
    o.num_region_sizes = 2;
    CHECK(box(&d, 4, 2, 2, 1, 2, &o));
    CHECK(refine_and_check(&d, &r) == MESHER_OK);
    fine = mean_edge(&d, lo, hi);
    coarse = mean_edge(&d, left_lo, left_hi);
    CHECK(fine > 0.16 && fine < 0.25);
    CHECK(coarse > 0.4);
    mesher_domain_free(&d);
    memset(&o, 0, sizeof o);
    for (i = 0; i < 45; i++) wish[i] = i % 5 == 4 ? 0.1 : i % 5 == 0 ? -1 : 1;
    o.vertex_sizes = wish;
    o.gradation = 1.4;
    CHECK(box(&d, 4, 2, 2, 1, 9, &o));
    d.surface.num_vertices = 45;
    CHECK(refine_and_check(&d, &r) == MESHER_OK);
    CHECK(r.refined_vertices > 300);
    CHECK(fabs(d.size[5] - 0.1) < 1e-12);
    CHECK(d.size[1] > 1);
    CHECK(fabs(d.size[4] - 0.5) < 1e-9); /* the gradation, over the distance of 1 */
    mesher_domain_free(&d);
}

static void a_grid_of_sizes(void)
{
    static double sizes[27];
    static const double lo[3] = {1.1, 1.1, 1.1}, hi[3] = {1.9, 1.9, 1.9};
    double x[3] = {0.75, 1.5, 1.5}, zero = 0;
    mesher_size_grid g;
    mesher_domain d;
    mesher_report r;
    mesher_options o;
    int i;
    memset(&o, 0, sizeof o);
    memset(&g, 0, sizeof g);
    for (i = 0; i < 27; i++) sizes[i] = i == 13 ? 0.1 : 0.9;
    for (i = 0; i < 3; i++) {
        g.spacing[i] = 1.5;
        g.count[i] = 3;
    }
    g.size = sizes;
    CHECK(fabs(mesher_size_grid_at(&g, x) - 0.5) < 1e-12);
    x[0] = -5;
    x[1] = x[2] = 9;
    CHECK(mesher_size_grid_at(&g, x) == 0.9);
    o.size_grid = &g;
    CHECK(box(&d, 6, 6, 6, 0.5, 9, &o));
    CHECK(refine_and_check(&d, &r) == MESHER_OK);
    CHECK(mean_edge(&d, lo, hi) > 0.1 && mean_edge(&d, lo, hi) < 0.4);
    CHECK(r.refined_vertices > 5);
    mesher_domain_free(&d);
    for (i = 0; i < 27; i++)
        sizes[i] = i & 1 ? zero / zero : 0; /* no wish anywhere: as if there were no grid */
    CHECK(mesher_size_grid_at(&g, x) == 0);
    CHECK(box(&d, 3, 3, 3, 1, 9, &o));
    CHECK(refine_and_check(&d, &r) == MESHER_OK);
    i = (int)r.refined_vertices;
    mesher_domain_free(&d);
    o.size_grid = NULL;
    CHECK(box(&d, 3, 3, 3, 1, 9, &o));
    CHECK(refine_and_check(&d, &r) == MESHER_OK);
    CHECK(i == (int)r.refined_vertices);
    mesher_domain_free(&d);
    g.count[1] = 1;
    o.size_grid = &g;
    CHECK(mesher_options_resolve(&o, &o) == MESHER_ERROR_INVALID_ARGUMENT);
}

/* An L of cubes of edge 0.5, 2 high, each of six tetrahedra, some turned over, and a flat one; its
 * sizes are those of tilted(). */
typedef struct tilted_mesh {
    mesher_size_mesh mesh;
    double  xyz[3 * 125], size[125];
    uint32_t tets[4 * 400];
} tilted_mesh;

static double tilted(const double *x) { return 0.5 + 0.1 * x[0] + 0.05 * x[1] - 0.15 * x[2]; }

static int tilted_mesh_set(tilted_mesh *l)
{
    static const int n[3] = {4, 4, 4};
    mesher_domain d;
    delaunay_handle t;
    uint32_t v, num = 0;
    int k;
    memset(l, 0, sizeof *l);
    if (!box_domain(&d, n, 0.5, NULL) || d.mesh.num_vertices != 126) return 0;
    for (v = 0; v < 125; v++) {
        memcpy(l->xyz + 3 * v, d.mesh.vertices[v + 1].x, 3 * sizeof(double));
        l->size[v] = tilted(l->xyz + 3 * v);
    }
    for (t = 1; t < d.mesh.num_tets; t++) {
        double middle[2] = {0, 0};
        for (k = 0; k < 4; k++) {
            middle[0] += d.mesh.vertices[d.mesh.tets[t].v[k]].x[0] / 4;
            middle[1] += d.mesh.vertices[d.mesh.tets[t].v[k]].x[1] / 4;
        }
        if (delaunay_is_deleted(&d.mesh, t) || (middle[0] > 1 && middle[1] > 1)) continue;
        for (k = 0; k < 4; k++)
            l->tets[4 * num + (uint32_t)(t % 3 ? k : k ^ (k < 2))] = d.mesh.tets[t].v[k] - 1;
        num++;
    }
    for (k = 0; k < 4; k++) l->tets[4 * num + (uint32_t)k] = (uint32_t)k; /* on a line */
    mesher_domain_free(&d);
    l->mesh.xyz = l->xyz;
    l->mesh.num_vertices = 125;
    l->mesh.tets = l->tets;
    l->mesh.num_tets = num + 1;
    l->mesh.size = l->size;
    return num == 288;
}

/* Moves x into the box from 0 to hi; returns the distance. */
static double clamp_to(const double *hi, double *x)
{
    double sum = 0;
    int k;
    for (k = 0; k < 3; k++) {
        double was = x[k];
        x[k] = x[k] < 0 ? 0 : x[k] > hi[k] ? hi[k] : x[k];
        sum += (was - x[k]) * (was - x[k]);
    }
    return sqrt(sum);
}

static void a_mesh_of_sizes(void)
{
    static tilted_mesh l;
    static const double arms[2][3] = {{1, 2, 2}, {2, 1, 2}}, far_away[3] = {1e70, -1e70, 1},
                        lo[3] = {0, 0, 1.2}, hi[3] = {2, 0.8, 2};
    mesher_size_mesh *s = &l.mesh;
    mesher_domain d;
    mesher_report r;
    mesher_options o;
    int i, k, inside = 0;
    memset(&o, 0, sizeof o);
    memset(&r, 0, sizeof r);
    o.size_mesh = s;
    CHECK(tilted_mesh_set(&l));
    CHECK(mesher_options_resolve(&o, &o) == MESHER_ERROR_INVALID_ARGUMENT);
    CHECK(mesher_size_mesh_init(s, NULL, &r) == MESHER_OK && r.message[0] == 0);
    for (i = 0; i < 20000; i++) {
        double x[3], at[2][3], distance[2], found;
        for (k = 0; k < 3; k++) x[k] = -1 + small_random(4000001) * 1e-6;
        for (k = 0; k < 3 && i % 3 == 0; k++) x[k] = floor(4 * x[k]) / 4; /* on borders as well */
        for (k = 0; k < 2; k++) {
            memcpy(at[k], x, sizeof x);
            distance[k] = clamp_to(arms[k], at[k]);
        }
        found = mesher_size_mesh_at(s, x);
        inside += distance[0] == 0 || distance[1] == 0;
        CHECK((distance[0] < distance[1] + 1e-6 && fabs(found - tilted(at[0])) < 1e-6) ||
              (distance[1] < distance[0] + 1e-6 && fabs(found - tilted(at[1])) < 1e-6));
    }
    CHECK(inside > 1000);
    CHECK(mesher_size_mesh_at(s, far_away) > 0.3);
    /* The sizes are obeyed; the surface alone would ask for more. */
    CHECK(box(&d, 2, 2, 2, 1, 9, &o));
    CHECK(refine_and_check(&d, &r) == MESHER_OK);
    CHECK(mean_edge(&d, lo, hi) > 0.3 && mean_edge(&d, lo, hi) < 0.55);
    mesher_domain_free(&d);
    for (i = 0; i < 125; i++) l.size[i] = i & 1 ? (double)NAN : -1; /* asks for nothing */
    CHECK(mesher_size_mesh_at(s, lo) == 0);
    mesher_size_mesh_free(s);
    CHECK(s->tree == NULL);
    mesher_size_mesh_free(s);
    mesher_size_mesh_free(NULL);
}

static void bad_meshes_of_sizes_are_refused(void)
{
    static tilted_mesh l;
    mesher_size_mesh *s = &l.mesh;
    mesher_report r;
    delaunay_host host;
    small_allocator a;
    int k, failed = 1;
    memset(&host, 0, sizeof host);
    memset(&a, 0, sizeof a);
    memset(&r, 0, sizeof r);
    host.allocator.alloc = small_alloc;
    host.allocator.release = small_release;
    host.allocator.user = &a;
    CHECK(tilted_mesh_set(&l));
    for (k = 0; k < 50 && failed; k++) {
        a.countdown = k;
        failed = mesher_size_mesh_init(s, &host, &r) == MESHER_ERROR_OUT_OF_MEMORY;
        CHECK(failed ? s->tree == NULL && r.message[0] : s->tree != NULL && !r.message[0]);
        a.countdown = -1;
        mesher_size_mesh_free(s);
        CHECK(a.outstanding == 0);
    }
    CHECK(!failed && k > 4);
    l.tets[4 * 17 + 2] = 125;
    CHECK(mesher_size_mesh_init(s, NULL, &r) == MESHER_ERROR_INVALID_ARGUMENT);
    CHECK(strstr(r.message, "tetrahedron 17 of the size mesh has vertex 125, which does not"));
    l.tets[4 * 17 + 2] = 60;
    l.xyz[3 * 60 + 1] = (double)NAN;
    CHECK(mesher_size_mesh_init(s, NULL, &r) == MESHER_ERROR_INVALID_ARGUMENT);
    CHECK(strstr(r.message, "has vertex 60, which is not within 1e60"));
    l.xyz[3 * 60 + 1] = 0;
    host.num_threads = -1;
    CHECK(mesher_size_mesh_init(s, &host, &r) == MESHER_ERROR_INVALID_ARGUMENT);
    CHECK(strstr(r.message, "the host"));
    for (k = 0; k < 375; k++) l.xyz[k] *= 1e-61;
    CHECK(mesher_size_mesh_init(s, NULL, &r) == MESHER_ERROR_INVALID_ARGUMENT);
    CHECK(strstr(r.message, "extent"));
    s->num_tets = 0;
    CHECK(mesher_size_mesh_init(s, NULL, &r) == MESHER_ERROR_INVALID_ARGUMENT);
    CHECK(strstr(r.message, "no tetrahedra"));
    CHECK(mesher_size_mesh_init(NULL, NULL, NULL) == MESHER_ERROR_INVALID_ARGUMENT);
}

/* Vertices that came between two refinements get sizes. */
static void a_mesh_that_has_grown_is_refined(void)
{
    mesher_domain d;
    mesher_report r;
    mesher_options o;
    double x[3] = {0.5, 0.5, 0.5};
    int i;
    memset(&o, 0, sizeof o);
    memset(&r, 0, sizeof r);
    o.size = 0.3;
    CHECK(box(&d, 2, 2, 2, 1, 9, &o));
    CHECK(refine_and_check(&d, &r) == MESHER_OK);
    for (i = 0; i < 5000; i++) CHECK(delaunay_add_vertex(&d.mesh, x, DELAUNAY_NO_ID) != 0);
    CHECK(d.num_sizes + 5000 == d.mesh.num_vertices);
    CHECK(mesher_refine(&d, &r) == MESHER_OK && small_valid(&d.mesh));
    CHECK(d.num_sizes == d.mesh.num_vertices);
    mesher_domain_free(&d);
}

/* A size that is 0 in doubles after its factor is not the same as none. */
static void a_size_may_underflow(void)
{
    mesher_domain d;
    mesher_report r;
    mesher_options o;
    memset(&o, 0, sizeof o);
    o.size = 0.2;
    o.size_factor = 5e-324;
    o.min_size = 0.25;
    CHECK(box(&d, 2, 2, 2, 1, 9, &o));
    CHECK(refine_and_check(&d, &r) == MESHER_OK && r.refined_vertices > 100);
    mesher_domain_free(&d);
}

/* The wish of a source, or of the same as a function. */
static void source_wish(void *user, size_t count, const double *xyz, const uint32_t *region,
                        double *out)
{
    size_t i;
    (void)region;
    for (i = 0; i < count; i++)
        out[i] = mesher_source_size((const mesher_source *)user, 0, xyz + 3 * i);
}

static int compare_doubles(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

/* The median of length over wanted length of edges inside, between least and most times radius from
 * the middle of a ball; *count: how many there are. */
static double length_around(const mesher_domain *d, const mesher_source *ball, double least,
                            double most, size_t *count)
{
    const delaunay_mesh *m = &d->mesh;
    double *ratio = (double *)malloc(6 * (size_t)m->num_tets * sizeof *ratio), median;
    delaunay_handle t;
    int e, k;
    *count = 0;
    for (t = 1; t < m->num_tets; t++)
        for (e = 0; e < 6 && !delaunay_is_deleted(m, t) && m->color[t]; e++) {
            const uint8_t *o = delaunay_edge_order(e);
            uint32_t a = m->tets[t].v[o[0]], b = m->tets[t].v[o[1]];
            const double *x = m->vertices[a].x, *y = m->vertices[b].x;
            double middle = 0, length = 0;
            if (m->vertex_id[a] != DELAUNAY_NO_ID || m->vertex_id[b] != DELAUNAY_NO_ID) continue;
            for (k = 0; k < 3; k++) {
                double z = (x[k] + y[k]) / 2 - ball->xyz[k];
                middle += z * z;
                length += (x[k] - y[k]) * (x[k] - y[k]);
            }
            if (sqrt(middle) < least * ball->radius || sqrt(middle) >= most * ball->radius)
                continue;
            ratio[(*count)++] = 2 * sqrt(length) /
                                (mesher_source_size(ball, 0, x) + mesher_source_size(ball, 0, y));
        }
    qsort(ratio, *count, sizeof *ratio, compare_doubles);
    median = *count ? ratio[*count / 2] : 0;
    free(ratio);
    return median;
}

/* A ball that is small beside the sizes around it, and far from all vertices, is seen, and so is
 * how sizes grow from there: of a source, and of a function. */
static void small_sources_are_seen(void)
{
    int kind;
    for (kind = 0; kind < 3; kind++) {
        mesher_domain d;
        mesher_report r;
        mesher_options o;
        mesher_source ball;
        size_t count;
        double ratio;
        memset(&o, 0, sizeof o);
        memset(&r, 0, sizeof r);
        memset(&ball, 0, sizeof ball);
        ball.xyz[0] = 3.53, ball.xyz[1] = 3.57, ball.xyz[2] = 3.51;
        ball.radius = 0.1;
        ball.size = 0.02;
        o.sources = &ball;
        o.num_sources = kind < 2;
        if (kind == 1) ball.slope = 1.5; /* steep: nobody comes near by chance */
        if (kind == 2) {
            o.size_function = source_wish;
            o.size_user = &ball;
        }
        CHECK(box(&d, 7, 7, 7, 1, 100, &o));
        CHECK(mesher_size(&d, &r) == MESHER_OK && mesher_refine(&d, &r) == MESHER_OK);
        ratio = length_around(&d, &ball, 0, 1, &count);
        CHECK(count > 1000 && ratio > 0.85 && ratio < 1.25);
        ratio = length_around(&d, &ball, 1, 4, &count);
        CHECK(count > 1000 && ratio > 0.85 && ratio < 1.35);
        CHECK(delaunay_validate(&d.mesh, DELAUNAY_VALIDATE_GEOMETRY, NULL) == DELAUNAY_OK);
        mesher_domain_free(&d);
    }
}

/* A ball beyond which nothing is asked for, in tetrahedra much larger than it, without a vertex in
 * it. */
static void steep_sources_are_seen(void)
{
    static const double around[2] = {0, 0.3}; /* size elsewhere */
    int k, cubes;
    for (k = 0; k < 2; k++)
        for (cubes = 1; cubes <= 2; cubes++) {
            mesher_domain d;
            mesher_report r;
            mesher_options o;
            mesher_source ball;
            size_t count;
            double ratio;
            memset(&o, 0, sizeof o);
            memset(&ball, 0, sizeof ball);
            ball.xyz[0] = ball.xyz[1] = ball.xyz[2] = 0.5;
            ball.radius = 0.03;
            ball.size = 0.005;
            ball.slope = HUGE_VAL;
            o.size = around[k];
            o.sources = &ball;
            o.num_sources = 1;
            CHECK(box(&d, cubes, cubes, cubes, 1.0 / cubes, 9, &o));
            CHECK(refine_and_check(&d, &r) == MESHER_OK && r.refined_vertices > 900);
            ratio = length_around(&d, &ball, 0, 1, &count);
            CHECK(count > 1000 && ratio > 0.85 && ratio < 1.25);
            mesher_domain_free(&d);
        }
}

/* So are small sizes in the midst of a size mesh or a size grid. */
static void steep_fields_are_seen(void)
{
    enum { N = 20, NODES = (N + 1) * (N + 1) * (N + 1) };
    static const int n[3] = {N, N, N};
    double *size = (double *)malloc(NODES * sizeof *size),
           *xyz = (double *)malloc(3 * NODES * sizeof *xyz);
    uint32_t *tets = (uint32_t *)malloc(24 * N * N * N * sizeof *tets), v, num = 0;
    mesher_source ball;
    mesher_size_mesh fine;
    mesher_size_grid grid;
    mesher_domain d;
    delaunay_handle t;
    int k, kind;
    memset(&ball, 0, sizeof ball);
    memset(&fine, 0, sizeof fine);
    memset(&grid, 0, sizeof grid);
    ball.xyz[0] = 0.3, ball.xyz[1] = 0.4, ball.xyz[2] = 0.7;
    ball.radius = 0.06;
    ball.size = 0.02;
    CHECK(box_domain(&d, n, 1.0 / N, NULL) && d.mesh.num_vertices == NODES + 1);
    for (v = 0; v < NODES; v++) {
        double *x = d.mesh.vertices[v + 1].x, rr = 0;
        for (k = 0; k < 3; k++) rr += pow(x[k] - ball.xyz[k], 2);
        size[v] = rr <= 0.12 * 0.12 ? ball.size : 1;
        memcpy(xyz + 3 * v, x, 3 * sizeof *x);
    }
    for (t = 1; t < d.mesh.num_tets; t++) {
        if (delaunay_is_deleted(&d.mesh, t)) continue;
        for (k = 0; k < 4; k++) tets[4 * num + (uint32_t)k] = d.mesh.tets[t].v[k] - 1;
        num++;
    }
    mesher_domain_free(&d);
    fine.xyz = xyz;
    fine.num_vertices = NODES;
    fine.tets = tets;
    fine.num_tets = num;
    grid.size = fine.size = size;
    for (k = 0; k < 3; k++) {
        grid.count[k] = N + 1;
        grid.spacing[k] = 1.0 / N;
    }
    CHECK(mesher_size_mesh_init(&fine, NULL, NULL) == MESHER_OK);
    for (kind = 0; kind < 4; kind++) {
        mesher_report r;
        mesher_options o;
        size_t count;
        double ratio;
        memset(&o, 0, sizeof o);
        if (kind & 1) o.size_mesh = &fine;
        else o.size_grid = &grid;
        o.size = kind & 2 ? 0.3 : 0;
        CHECK(box(&d, 1, 1, 1, 1, 9, &o));
        CHECK(refine_and_check(&d, &r) == MESHER_OK);
        ratio = length_around(&d, &ball, 0, 1, &count);
        CHECK(count > 500 && ratio > 0.85 && ratio < 1.25);
        mesher_domain_free(&d);
    }
    mesher_size_mesh_free(&fine);
    free(tets);
    free(xyz);
    free(size);
}

/* What is between two regions has the sizes of either, whatever their numbers. */
static void regions_share_their_border(void)
{
    int fine;
    for (fine = 0; fine < 2; fine++) {
        mesher_domain d;
        mesher_report r;
        mesher_options o;
        double sizes[2] = {0, 0};
        uint32_t v, on = 0;
        memset(&o, 0, sizeof o);
        memset(&r, 0, sizeof r);
        sizes[fine] = 0.25;
        o.region_sizes = sizes;
        o.num_region_sizes = 2;
        CHECK(box(&d, 4, 2, 2, 1, 2, &o));
        CHECK(mesher_size(&d, &r) == MESHER_OK);
        for (v = 1; v <= d.mesh.num_points; v++) {
            const double x = d.mesh.vertices[v].x[0] - 2;
            if (x == 0) on++;
            if (x == 0 || (fine ? x > 0 : x < 0)) CHECK(d.size[v] <= 0.25);
            else CHECK(d.size[v] > 0.25);
        }
        CHECK(on > 0);
        mesher_domain_free(&d);
    }
}

/* Flat sides are not curved, at a crease and between regions either. */
static void flat_is_not_curved(void)
{
    double size[2][500];
    uint32_t v, n = 0;
    int curved;
    for (curved = 0; curved < 2; curved++) {
        mesher_domain d;
        mesher_report r;
        mesher_options o;
        memset(&o, 0, sizeof o);
        memset(&r, 0, sizeof r);
        o.curvature_degrees = 5 * curved;
        CHECK(box(&d, 4, 3, 3, 1, 2, &o));
        CHECK(mesher_size(&d, &r) == MESHER_OK);
        n = d.mesh.num_vertices < 500 ? d.mesh.num_vertices : 500;
        for (v = 1; v < n; v++) size[curved][v] = d.size[v];
        mesher_domain_free(&d);
    }
    for (v = 1; v < n; v++) CHECK(size[0][v] == size[1][v]);
}

static void layers_between_facets(void)
{
    uint64_t before = 0;
    int layers;
    for (layers = 0; layers < 5; layers += 2) { /* a plate as thick as its edges are long */
        mesher_domain d;
        mesher_report r;
        mesher_options o;
        uint32_t v;
        memset(&o, 0, sizeof o);
        o.layers = layers;
        CHECK(box(&d, 6, 6, 1, 1, 99, &o));
        CHECK(refine_and_check(&d, &r) == MESHER_OK);
        for (v = 1; v <= d.mesh.num_points && layers; v++) CHECK(d.size[v] <= 1.0 / layers + 1e-12);
        CHECK(layers ? r.refined_vertices > before : r.refined_vertices == 0);
        before = r.refined_vertices;
        mesher_domain_free(&d);
    }
}

static void a_factor_scales_all_sizes(void)
{
    uint64_t before = 0;
    int k;
    for (k = 0; k < 6; k++) {
        mesher_domain d;
        mesher_report r;
        mesher_options o;
        memset(&o, 0, sizeof o);
        o.size_factor = k % 3 == 0 ? 1 : k % 3 == 1 ? 0.5 : 0.25;
        o.size = k < 3 ? 0 : 0.9; /* the surface's, or that of all the inside */
        CHECK(box(&d, 4, 4, 4, 1, 9, &o));
        CHECK(refine_and_check(&d, &r) == MESHER_OK);
        CHECK(k % 3 == 0 || r.refined_vertices > 5 * before);
        before = r.refined_vertices;
        mesher_domain_free(&d);
    }
}

static void nonsense_is_refused(void)
{
    mesher_options o, out;
    mesher_source s;
    memset(&o, 0, sizeof o);
    memset(&s, 0, sizeof s);
    o.num_sources = 1;
    CHECK(mesher_options_resolve(&out, &o) == MESHER_ERROR_INVALID_ARGUMENT);
    o.sources = &s;
    CHECK(mesher_options_resolve(&out, &o) == MESHER_ERROR_INVALID_ARGUMENT); /* size 0 */
    s.size = 1;
    CHECK(mesher_options_resolve(&out, &o) == MESHER_OK);
    s.radius = -1;
    CHECK(mesher_options_resolve(&out, &o) == MESHER_ERROR_INVALID_ARGUMENT);
    memset(&o, 0, sizeof o);
    o.num_region_sizes = 3;
    CHECK(mesher_options_resolve(&out, &o) == MESHER_ERROR_INVALID_ARGUMENT);
    memset(&o, 0, sizeof o);
    o.layers = -1;
    CHECK(mesher_options_resolve(&out, &o) == MESHER_ERROR_INVALID_ARGUMENT);
    o.layers = 0;
    o.size_factor = -2;
    CHECK(mesher_options_resolve(&out, &o) == MESHER_ERROR_INVALID_ARGUMENT);
}

static void bounds_and_gradation(void)
{
    mesher_domain d;
    mesher_report r;
    mesher_options o;
    uint64_t coarse, fine;
    memset(&o, 0, sizeof o);
    o.size = 0.1;
    o.min_size = 0.5;
    CHECK(box(&d, 2, 2, 2, 1, 9, &o));
    CHECK(refine_and_check(&d, &r) == MESHER_OK);
    coarse = r.refined_vertices;
    mesher_domain_free(&d);
    o.min_size = 0;
    o.size = 0;
    o.max_size = 0.25;
    CHECK(box(&d, 2, 2, 2, 1, 9, &o));
    CHECK(refine_and_check(&d, &r) == MESHER_OK);
    fine = r.refined_vertices;
    CHECK(fine > 3 * coarse);
    mesher_domain_free(&d);
}

/* A prism over a convex polygon of n corners, with fans for its ends: 2n vertices, 4n-4 triangles.
 */
static void prism(mesher_surface *surface, double *xyz, uint32_t *triangles, uint32_t n,
                  const double *polygon, double height)
{
    uint32_t i, k, *t = triangles;
    for (i = 0; i < 2 * n; i++) {
        xyz[3 * i] = polygon[2 * (i % n)];
        xyz[3 * i + 1] = polygon[2 * (i % n) + 1];
        xyz[3 * i + 2] = i < n ? 0 : height;
    }
    for (i = 0; i < n; i++) {
        uint32_t j = (i + 1) % n, corner[12];
        corner[0] = i, corner[1] = j, corner[2] = n + j;
        corner[3] = i, corner[4] = n + j, corner[5] = n + i;
        corner[6] = 0, corner[7] = j, corner[8] = i;
        corner[9] = n, corner[10] = n + i, corner[11] = n + j;
        for (k = 0; k < (i > 0 && j > 0 ? 12u : 6u); k++) *t++ = corner[k];
    }
    memset(surface, 0, sizeof *surface);
    surface->xyz = xyz;
    surface->num_vertices = 2 * n;
    surface->triangles = triangles;
    surface->num_triangles = 4 * n - 4;
}

/* The rims of a prism over a regular polygon of n corners on the unit circle. Between neighbours on
 * a rim the normal turns by the angle of an edge, if that is no crease; at the corners that the
 * fans of the ends begin from, if these have very many triangles, by two thirds of it. */
static void curved_sides_have_their_sizes(void)
{
    enum { MOST = 1100 };
    static const uint32_t corners[] = {7, 48, MOST};
    double *polygon = (double *)malloc(8 * MOST * sizeof *polygon), *xyz = polygon + 2 * MOST;
    uint32_t *triangles = (uint32_t *)malloc(12 * MOST * sizeof *triangles), i, v;
    for (i = 0; i < 3; i++) {
        const uint32_t n = corners[i];
        const double angle = 6.283185307179586 / n, edge = 2 * sin(angle / 2);
        mesher_surface surface;
        mesher_options o;
        mesher_domain d;
        for (v = 0; v < n; v++) {
            polygon[2 * v] = cos(angle * v);
            polygon[2 * v + 1] = sin(angle * v);
        }
        prism(&surface, xyz, triangles, n, polygon, 0.5);
        memset(&o, 0, sizeof o);
        o.no_refine = 1;
        o.curvature_degrees = 0.6 * 360 / n;
        CHECK(mesher_mesh(&d, &surface, &o, NULL) == MESHER_OK);
        CHECK(mesher_size(&d, NULL) == MESHER_OK);
        for (v = 1; v < d.mesh.num_vertices; v++) {
            const uint32_t id = d.mesh.vertex_id[v];
            const double wanted = n == MOST && id % n == 0 ? 0.9 * edge : 0.6 * edge;
            const double size = d.size[v];
            if (id >= 2 * n) continue; /* a corner of the box */
            if (n == 7) CHECK(size > edge);
            else CHECK(fabs(size - wanted) < 1e-6 * wanted);
        }
        mesher_domain_free(&d);
    }
    free(polygon);
    free(triangles);
}

/* A small size at one end of a bar bounds those at the other, hundreds of edges away. */
static void slow_growth_reaches_far(void)
{
    static const double square[8] = {0, 0, 1, 0, 1, 1, 0, 1};
    double xyz[24], worst = 0, *sizes;
    uint32_t triangles[36], v;
    mesher_surface bar;
    mesher_fine_surface fine;
    mesher_domain d;
    mesher_options o;
    delaunay_handle t;
    int e;
    prism(&bar, xyz, triangles, 4, square, 300);
    memset(&o, 0, sizeof o);
    o.size = 1;
    CHECK(mesher_refine_surface(&fine, &bar, &o, NULL) == MESHER_OK);
    sizes = (double *)calloc(fine.surface.num_vertices, sizeof *sizes);
    for (v = 0; v < fine.surface.num_vertices; v++) sizes[v] = fine.xyz[3 * v + 2] < 0.5 ? 0.3 : 0;
    memset(&o, 0, sizeof o);
    o.vertex_sizes = sizes;
    o.gradation = 1.001;
    o.no_refine = 1;
    CHECK(mesher_mesh(&d, &fine.surface, &o, NULL) == MESHER_OK);
    CHECK(mesher_size(&d, NULL) == MESHER_OK);
    for (t = 1; t < d.mesh.num_tets; t++)
        for (e = 0; e < 6; e++) {
            uint32_t a = d.mesh.tets[t].v[delaunay_edge_order(e)[0]];
            uint32_t b = d.mesh.tets[t].v[delaunay_edge_order(e)[1]];
            const double *x = d.mesh.vertices[a].x, *y = d.mesh.vertices[b].x;
            double u[3] = {x[0] - y[0], x[1] - y[1], x[2] - y[2]}, excess;
            if (delaunay_is_deleted(&d.mesh, t) || d.mesh.color[t] == DELAUNAY_OUTSIDE) continue;
            excess = fabs(d.size[a] - d.size[b]) -
                     0.001 * sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2]);
            if (excess > worst) worst = excess;
        }
    CHECK(worst < 1e-6);
    free(sizes);
    mesher_domain_free(&d);
    mesher_fine_surface_free(&fine);
}

/* A size of next to nothing, at one place. */
static void spot(void *user, size_t count, const double *xyz, const uint32_t *region, double *out)
{
    const double *at = (const double *)user;
    size_t i;
    (void)region;
    for (i = 0; i < count; i++) {
        double x = xyz[3 * i] - at[0], y = xyz[3 * i + 1] - at[1], z = xyz[3 * i + 2] - at[2];
        out[i] = x * x + y * y + z * z < 1e-6 ? 1e-30 : 0.2;
    }
}

/* No vertex gets a size that coordinates cannot tell apart, wherever it is asked for: here where
 * the first point of a lattice would be. */
static void sizes_have_a_floor(void)
{
    static const double xyz[12] = {1, 1, 1.3, 1, -1, -1, -1, 1, -1, -1, -1, 1};
    static const uint32_t triangles[12] = {0, 1, 2, 0, 2, 3, 0, 3, 1, 1, 3, 2};
    double centre[3] = {0.080232558139535004, 0.080232558139535004, 0.080232558139535115};
    mesher_surface s;
    mesher_domain d;
    mesher_options o;
    uint32_t v;
    memset(&s, 0, sizeof s);
    memset(&o, 0, sizeof o);
    s.xyz = xyz;
    s.num_vertices = 4;
    s.triangles = triangles;
    s.num_triangles = 4;
    o.size_function = spot;
    o.size_user = centre;
    o.max_vertices = 1000;
    CHECK(mesher_mesh(&d, &s, &o, NULL) == MESHER_STOPPED_BY_BUDGET);
    for (v = 1; v < d.mesh.num_vertices; v++) CHECK(!(d.size[v] > 0) || d.size[v] > 1e-14);
    mesher_domain_free(&d);
}

/* After a budget has stopped it, refinement goes on where the budget is raised. */
static void a_raised_budget_lets_it_go_on(void)
{
    mesher_domain d;
    mesher_report r;
    mesher_options o;
    memset(&o, 0, sizeof o);
    o.size = 0.1;
    o.max_vertices = 500;
    CHECK(box(&d, 2, 2, 2, 1, 9, &o));
    CHECK(refine_and_check(&d, &r) == MESHER_STOPPED_BY_BUDGET);
    d.options.max_vertices = 0;
    memset(&r, 0, sizeof r);
    CHECK(mesher_refine(&d, &r) == MESHER_OK);
    CHECK(small_valid(&d.mesh) && r.refined_vertices > 3000);
    CHECK(r.size_p50 > 0.8 && r.size_p50 < 1.25);
    mesher_domain_free(&d);
}

/* Each allocation fails once, while many points are inserted in sections. */
static void failing_allocations_leave_a_valid_mesh(void)
{
    small_allocator a;
    int k, failed = 1;
    for (k = 0; k < 500 && failed; k++) {
        mesher_domain d;
        mesher_report r;
        mesher_options o;
        mesher_result result;
        memset(&o, 0, sizeof o);
        memset(&a, 0, sizeof a);
        a.countdown = -1;
        o.size = 0.12;
        o.host.num_threads = 1 + k % 2;
        o.host.allocator.alloc = small_alloc;
        o.host.allocator.release = small_release;
        o.host.allocator.user = &a;
        CHECK(box(&d, 2, 2, 2, 1, 9, &o) && mesher_size(&d, &r) == MESHER_OK);
        a.countdown = k;
        memset(&r, 0, sizeof r);
        result = mesher_refine(&d, &r);
        failed = a.countdown <= 0;
        a.countdown = -1;
        CHECK(result == MESHER_OK || result == MESHER_ERROR_OUT_OF_MEMORY);
        CHECK(small_valid(&d.mesh));
        mesher_domain_free(&d);
        CHECK(a.outstanding == 0);
    }
    CHECK(!failed && k > 20);
}

static void note_warning(void *user, int level, const char *text)
{
    if (level == DELAUNAY_LOG_WARNING) snprintf((char *)user, 200, "%s", text);
}

static void sizes_that_ask_for_far_too_much_are_told(void)
{
    static const double sizes[2] = {0.1, 1e-4};
    mesher_domain d;
    mesher_report r;
    mesher_options o;
    char text[200];
    int k;
    memset(&o, 0, sizeof o);
    o.max_tets = 2000;
    o.host.log = note_warning;
    o.host.user = text;
    for (k = 0; k < 2; k++) {
        o.size = sizes[k];
        text[0] = 0;
        CHECK(box(&d, 2, 2, 2, 1, 9, &o));
        CHECK(refine_and_check(&d, &r) == MESHER_STOPPED_BY_BUDGET);
        CHECK((strstr(text, "the sizes ask for about") != NULL) == (k == 1));
        mesher_domain_free(&d);
    }
    o.max_tets = 0; /* without a budget, more than there are numbers for is refused */
    o.size = 1e-9;
    memset(&r, 0, sizeof r);
    CHECK(box(&d, 2, 2, 2, 1, 9, &o));
    CHECK(mesher_refine(&d, &r) == MESHER_ERROR_TOO_LARGE);
    CHECK(strstr(r.message, "the sizes ask for about") != NULL);
    mesher_domain_free(&d);
}

#if !defined(LINKED)
/* The mean of 1 / h^3 by a closed form, and by the sum over a fine grid of barycentric places. */
static void densities_of_linear_sizes(void)
{
    static const double sizes[4][4] = {{2, 2, 2, 2}, {1, 2, 3, 4}, {4, 1, 4, 1}, {5, 5, 1, 5}};
    enum { N = 60 };
    int s, i, j, k;
    for (s = 0; s < 4; s++) {
        const double *h = sizes[s];
        double sum = 0, n = 0;
        for (i = 0; i < N; i++)
            for (j = 0; i + j < N; j++)
                for (k = 0; i + j + k < N; k++) {
                    double a = (i + 0.25) / N, b = (j + 0.25) / N, c = (k + 0.25) / N;
                    double at = a * h[0] + b * h[1] + c * h[2] + (1 - a - b - c) * h[3];
                    sum += 1 / (at * at * at);
                    n++;
                }
        CHECK(fabs(mesher__mean_density(h) * n / sum - 1) < 0.03);
    }
}
#endif

/* A cube with tiny sizes on one side: there is no room for a large lattice, but sizes grow over its
 * whole height from there. */
static void steep_sizes_that_ask_for_too_much_are_told(void)
{
    static const double xyz[24] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0,
                                   0, 0, 1, 1, 0, 1, 0, 1, 1, 1, 1, 1};
    static const uint32_t triangles[36] = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                           2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
    int k, i;
    for (k = 0; k < 2; k++) {
        double sizes[8];
        char text[200] = "";
        mesher_surface s;
        mesher_domain d;
        mesher_options o;
        memset(&s, 0, sizeof s);
        memset(&o, 0, sizeof o);
        for (i = 0; i < 8; i++) sizes[i] = i < 4 ? (k ? 1e-6 : 0.1) : 1;
        s.xyz = xyz;
        s.num_vertices = 8;
        s.triangles = triangles;
        s.num_triangles = 12;
        o.vertex_sizes = sizes;
        o.max_tets = 2000;
        o.host.log = note_warning;
        o.host.user = text;
        CHECK(mesher_mesh(&d, &s, &o, NULL) >= 0);
        CHECK((strstr(text, "the sizes ask for about") != NULL) == (k == 1));
        mesher_domain_free(&d);
    }
}

/* The lattices that the sizes ask for do not fit the limit; what fits is made all the same. */
static void a_memory_limit_is_used_up(void)
{
    static const double sizes[3] = {0.06, 0.03, 0.015};
    mesher_domain d;
    mesher_report r;
    mesher_options o;
    int k;
    memset(&o, 0, sizeof o);
    for (k = 0; k < 6; k++) {
        o.size = sizes[k % 3];
        o.host.memory_limit_bytes = k < 3 ? 10000000 : 20000000;
        CHECK(box(&d, 2, 2, 2, 1, 9, &o));
        CHECK(refine_and_check(&d, &r) == MESHER_STOPPED_BY_BUDGET);
        CHECK(r.num_tets > o.host.memory_limit_bytes / 250);
        CHECK(r.peak_bytes <= o.host.memory_limit_bytes);
        mesher_domain_free(&d);
    }
}

static void budgets_leave_a_valid_mesh(void)
{
    static const char *const budgets[4] = {"max_vertices, 500", "max_tets, 2000",
                                           "max_seconds, 1e-09",
                                           "host.memory_limit_bytes, 1500000"};
    mesher_domain d;
    mesher_report r;
    mesher_options o;
    small_allocator a;
    int k;
    memset(&o, 0, sizeof o);
    o.size = 0.1;
    for (k = 0; k < 4; k++) {
        mesher_options p = o;
        if (k == 0) p.max_vertices = 500;
        if (k == 1) p.max_tets = 2000;
        if (k == 2) p.max_seconds = 1e-9;
        if (k == 3) p.host.memory_limit_bytes = 1500000;
        CHECK(box(&d, 2, 2, 2, 1, 9, &p));
        CHECK(refine_and_check(&d, &r) == MESHER_STOPPED_BY_BUDGET);
        CHECK(strstr(r.message, budgets[k]) != NULL);
        if (k == 0) CHECK(d.mesh.num_vertices - 1 == 500);
        if (k == 1) CHECK(r.num_tets <= 2000 && r.num_tets > 1800);
        mesher_domain_free(&d);
    }
    for (k = 30; k < 400; k += 7) { /* allocations that fail leave it valid as well */
        mesher_options p = o;
        mesher_result result;
        memset(&a, 0, sizeof a);
        a.countdown = -1;
        p.size = 0.3;
        p.host.allocator.alloc = small_alloc;
        p.host.allocator.release = small_release;
        p.host.allocator.user = &a;
        if (!box(&d, 2, 2, 2, 1, 9, &p)) continue;
        a.countdown = k - 30;
        memset(&r, 0, sizeof r);
        result = mesher_size(&d, &r);
        if (result == MESHER_OK) result = mesher_refine(&d, &r);
        a.countdown = -1;
        CHECK(result == MESHER_OK || result == MESHER_ERROR_OUT_OF_MEMORY);
        CHECK(small_valid(&d.mesh));
        mesher_domain_free(&d);
        CHECK(a.outstanding == 0);
    }
}

static int cancel(void *user, const char *phase, double fraction)
{
    (void)phase;
    (void)fraction;
    return ++*(int *)user > 1;
}

static void a_cancelled_mesh_is_valid(void)
{
    mesher_domain d;
    mesher_report r;
    mesher_options o;
    int calls = 0;
    memset(&o, 0, sizeof o);
    o.size = 0.1;
    o.host.progress = cancel;
    o.host.user = &calls;
    CHECK(box(&d, 2, 2, 2, 1, 9, &o));
    CHECK(refine_and_check(&d, &r) == MESHER_CANCELLED);
    mesher_domain_free(&d);
}

static void threads_give_the_same_bytes(void)
{
    static const int threads[3] = {1, 2, 7};
    uint64_t hash = 0;
    int k;
    for (k = 0; k < 3; k++) {
        mesher_domain d;
        mesher_report r;
        mesher_options o;
        memset(&o, 0, sizeof o);
        o.size = 0.08; /* enough points for several sections */
        o.host.num_threads = threads[k];
        CHECK(box(&d, 2, 2, 2, 1, 9, &o));
        CHECK(refine_and_check(&d, &r) == MESHER_OK);
        CHECK(r.refined_vertices > 12000);
        if (k == 0) hash = mesh_hash(&d);
        CHECK(mesh_hash(&d) == hash);
        mesher_domain_free(&d);
    }
}

/* A sphere of radius 1 by subdivision of an octahedron; returns the number of triangles. */
static uint32_t ball_of(int times, double *xyz, uint32_t *triangles, uint32_t *num_vertices)
{
    static const uint32_t octahedron[24] = {0, 2, 4, 2, 1, 4, 1, 3, 4, 3, 0, 4,
                                            2, 0, 5, 1, 2, 5, 3, 1, 5, 0, 3, 5};
    uint32_t n = 8, v = 6, i, j, k;
    memset(xyz, 0, 18 * sizeof *xyz);
    for (i = 0; i < 6; i++) xyz[3 * i + i / 2] = i & 1 ? -1 : 1;
    memcpy(triangles, octahedron, sizeof octahedron);
    for (; times; times--) {
        uint32_t old = n, first = v;
        for (i = 0; i < old; i++) {
            uint32_t c[3], m[3];
            memcpy(c, triangles + 3 * i, sizeof c);
            for (k = 0; k < 3; k++) {
                double x[3], l = 0;
                for (j = 0; j < 3; j++) {
                    x[j] = xyz[3 * c[k] + j] + xyz[3 * c[(k + 1) % 3] + j];
                    l += x[j] * x[j];
                }
                for (j = 0; j < 3; j++) x[j] /= sqrt(l);
                for (m[k] = first; m[k] < v && memcmp(xyz + 3 * m[k], x, sizeof x); m[k]++) {}
                if (m[k] == v) memcpy(xyz + 3 * v++, x, sizeof x);
            }
            memcpy(triangles + 3 * i, m, sizeof m);
            for (k = 0; k < 3; k++) {
                uint32_t *t = triangles + 3 * n++;
                t[0] = c[k];
                t[1] = m[k];
                t[2] = m[(k + 2) % 3];
            }
        }
    }
    *num_vertices = v;
    return n;
}

static mesher_surface ball_surface(const double *xyz, uint32_t num_vertices,
                                   const uint32_t *triangles, uint32_t num_triangles)
{
    mesher_surface surface;
    memset(&surface, 0, sizeof surface);
    surface.xyz = xyz;
    surface.num_vertices = num_vertices;
    surface.triangles = triangles;
    surface.num_triangles = num_triangles;
    return surface;
}

/* From the surface on, by the everyday function. */
/* Far from the origin, where edges have a hundred thousand units in the last place, and beside a
 * body that is ten million times larger, a ball is meshed as well as at the origin. */
static void far_and_small_balls_are_refined(void)
{
    static double xyz[3 * 600];
    static uint32_t triangles[3 * 1200];
    int way;
    for (way = 0; way < 3; way++) {
        mesher_domain d;
        mesher_surface surface;
        mesher_report r;
        uint32_t nv, nt = ball_of(3, xyz, triangles, &nv), v, k;
        memset(&surface, 0, sizeof surface);
        memset(&r, 0, sizeof r);
        for (k = 0; k < 3 * nv; k++) {
            if (way == 1) xyz[k] += 1e10;
            if (way == 2) xyz[k + 3 * nv] = 1e7 * xyz[k] + 1.5e7;
        }
        for (k = 0; way == 2 && k < 3 * nt; k++) triangles[k + 3 * nt] = triangles[k] + nv;
        surface.xyz = xyz;
        surface.num_vertices = way == 2 ? 2 * nv : nv;
        surface.triangles = triangles;
        surface.num_triangles = way == 2 ? 2 * nt : nt;
        CHECK(surface.num_vertices <= 600 && surface.num_triangles <= 1200);
        CHECK(mesher_mesh(&d, &surface, NULL, &r) == MESHER_OK);
        for (k = 0, v = 1; v < d.mesh.num_vertices; v++) {
            const double *x = d.mesh.vertices[v].x;
            k += d.mesh.vertex_id[v] == DELAUNAY_NO_ID &&
                 (way != 2 || fabs(x[0]) + fabs(x[1]) + fabs(x[2]) < 3);
        }
        if (k < 100) printf("way %d: %u points\n", way, k);
        CHECK(k >= 100);
        CHECK(r.size_p50 > 0.8 && r.size_p50 < 1.25);
        mesher_domain_free(&d);
    }
}

static void a_ball_end_to_end(void)
{
    static double xyz[3 * 2000];
    static uint32_t triangles[3 * 4000];
    uint64_t hash = 0;
    int threads;
    for (threads = 1; threads <= 4; threads += 3) {
        mesher_domain d;
        mesher_surface surface;
        mesher_options o;
        mesher_report r;
        uint32_t nv, nt = ball_of(4, xyz, triangles, &nv);
        surface = ball_surface(xyz, nv, triangles, nt);
        memset(&o, 0, sizeof o);
        memset(&r, 0, sizeof r);
        o.host.num_threads = threads;
        CHECK(nv == 1026 && nt == 2048);
        CHECK(mesher_mesh(&d, &surface, &o, &r) == MESHER_OK);
        CHECK(r.refined_vertices > 1000 && r.refined_vertices < 4000);
        CHECK(r.size_in_band > 0.9);
        CHECK(delaunay_validate(&d.mesh, DELAUNAY_VALIDATE_GEOMETRY, NULL) == DELAUNAY_OK);
        if (threads == 1) hash = mesh_hash(&d);
        CHECK(mesh_hash(&d) == hash);
        mesher_domain_free(&d);
    }
}

/* Few points in a rough ball: their cavities are large, and cut until they are star-shaped. */
static void large_cavities_are_cut(int times, double roughness, double size, uint32_t seed)
{
    static double xyz[3 * 5000];
    static uint32_t triangles[3 * 10000];
    mesher_domain d;
    mesher_surface surface;
    mesher_options o;
    mesher_report r;
    uint32_t nv, nt = ball_of(times, xyz, triangles, &nv), i;
    memset(&surface, 0, sizeof surface);
    memset(&o, 0, sizeof o);
    memset(&r, 0, sizeof r);
    for (i = 0; i < nv; i++) {
        double f;
        seed = seed * 1664525u + 1013904223u;
        f = 1 + roughness * (seed >> 8) / 16777216.0;
        xyz[3 * i] *= f, xyz[3 * i + 1] *= f, xyz[3 * i + 2] *= f;
    }
    surface.xyz = xyz;
    surface.num_vertices = nv;
    surface.triangles = triangles;
    surface.num_triangles = nt;
    o.size = size;
    CHECK(mesher_mesh(&d, &surface, &o, &r) == MESHER_OK);
    CHECK(r.refined_vertices > 0);
    CHECK(delaunay_validate(&d.mesh, DELAUNAY_VALIDATE_GEOMETRY, NULL) == DELAUNAY_OK);
    mesher_domain_free(&d);
}

/* Tiny sizes at the corners of a plate stay there: what is interpolated across it are the sizes
 * that its vertices ask for, not what the gradation leaves of them. */
static void small_corners_do_not_fill_a_plate(void)
{
    static const double corner[8] = {0, 0, 10, 0, 10, 10, 0, 10},
                        next[8] = {1, 0, 0, 1, -1, 0, 0, -1};
    double polygon[24], xyz[72], wish[24];
    uint32_t triangles[3 * 44];
    mesher_domain d;
    mesher_surface surface;
    mesher_options o;
    mesher_report r;
    int i, k;
    for (i = 0; i < 4; i++)
        for (k = 0; k < 2; k++) { /* before, in and after the corner */
            double back = -next[(2 * i + 6 + k) % 8], on = next[2 * i + k];
            polygon[6 * i + k] = corner[2 * i + k] + 0.01 * back;
            polygon[6 * i + 2 + k] = corner[2 * i + k] + 0.003 * (back + on);
            polygon[6 * i + 4 + k] = corner[2 * i + k] + 0.01 * on;
        }
    for (i = 0; i < 24; i++) wish[i] = i % 3 == 1 ? 0.01 : 1;
    prism(&surface, xyz, triangles, 12, polygon, 1);
    memset(&o, 0, sizeof o);
    memset(&r, 0, sizeof r);
    o.vertex_sizes = wish;
    o.max_vertices = 20000;
    CHECK(mesher_mesh(&d, &surface, &o, &r) == MESHER_OK);
    CHECK(r.refined_vertices > 20 && r.refined_vertices < 5000);
    for (i = 0; i < 24 && d.size; i++) CHECK(d.size[d.mesh.vertex_of[i]] < 0.03);
    mesher_domain_free(&d);
}

/* The share of tetrahedra of a body-centred lattice for size h: four edges of 1.04 h and two of
 * 1.2 h. */
static double lattice_share(const delaunay_mesh *mesh, double h)
{
    size_t all = 0, regular = 0;
    delaunay_handle t;
    for (t = 1; t < mesh->num_tets; t++) {
        int e, is_short = 0, is_long = 0;
        if (delaunay_is_deleted(mesh, t) || delaunay_is_ghost(mesh, t) || !mesh->color[t]) continue;
        for (e = 0; e < 6; e++) {
            const uint8_t *end = delaunay_edge_order(e);
            const double *a = mesh->vertices[mesh->tets[t].v[end[0]]].x,
                         *b = mesh->vertices[mesh->tets[t].v[end[1]]].x;
            double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2],
                   length = sqrt(x * x + y * y + z * z) / h;
            is_short += fabs(length - sqrt(1.08)) < 1e-6;
            is_long += fabs(length - 1.2) < 1e-6;
        }
        all++;
        regular += is_short == 4 && is_long == 2;
    }
    return all ? (double)regular / (double)all : 0;
}

static void one_size(void *user, size_t count, const double *xyz, const uint32_t *region,
                     double *out)
{
    size_t i;
    (void)xyz;
    (void)region;
    for (i = 0; i < count; i++) out[i] = *(const double *)user;
}

/* However sizes far below the surface's edges are asked for, most of the inside is a lattice. */
static void small_sizes_get_a_lattice(void)
{
    static const double square[8] = {0, 0, 1, 0, 1, 1, 0, 1};
    double xyz[24], h = 0.05;
    uint32_t triangles[36];
    mesher_surface surface;
    int way;
    prism(&surface, xyz, triangles, 4, square, 1);
    for (way = 0; way < 4; way++) {
        mesher_domain d;
        mesher_options o;
        mesher_report r;
        memset(&o, 0, sizeof o);
        memset(&r, 0, sizeof r);
        if (way == 0) o.size = h, o.max_vertices = UINT64_MAX; /* a budget without end */
        if (way == 1) o.max_size = h;
        if (way == 2) o.region_sizes = &h, o.num_region_sizes = 1;
        if (way == 3) o.size_function = one_size, o.size_user = &h;
        CHECK(mesher_mesh(&d, &surface, &o, &r) == MESHER_OK);
        CHECK(r.refined_vertices > 5000);
        CHECK(lattice_share(&d.mesh, h) > 0.5);
        mesher_domain_free(&d);
    }
}

/* Sizes far below the lengths of the needles at both ends of a coin: the mesh is finished without
 * digging thousands of cavities of thousands of tetrahedra in vain. */
static void needles_do_not_hold_up(void)
{
    enum { N = 200 };
    static double polygon[2 * N], xyz[6 * N];
    static uint32_t triangles[12 * N];
    uint64_t hash = 0;
    int i, threads;
    for (i = 0; i < N; i++) {
        polygon[2 * i] = 10 * cos(2 * 3.14159265358979 * i / N);
        polygon[2 * i + 1] = 10 * sin(2 * 3.14159265358979 * i / N);
    }
    for (threads = 1; threads <= 3; threads += 2) {
        mesher_domain d;
        mesher_surface surface;
        mesher_options o;
        mesher_report r;
        prism(&surface, xyz, triangles, N, polygon, 0.6);
        memset(&o, 0, sizeof o);
        memset(&r, 0, sizeof r);
        o.size = 0.25;
        o.host.num_threads = threads;
        CHECK(mesher_mesh(&d, &surface, &o, &r) == MESHER_OK);
        CHECK(r.refined_vertices > 5000);
        CHECK(r.size_in_band > 0.5);
        CHECK(delaunay_validate(&d.mesh, DELAUNAY_VALIDATE_GEOMETRY, NULL) == DELAUNAY_OK);
        if (threads == 1) hash = mesh_hash(&d);
        CHECK(mesh_hash(&d) == hash);
        mesher_domain_free(&d);
    }
}

/* Isosurfaces that pass nodes of their grid by 1e-9: neither are points heaped up around each, nor
 * are sizes looked for in one of the specks, of which floating point cannot find the way out. */
static void specks_do_not_hold_up(void)
{
    static const uint32_t nodes[2] = {9, 17}, most[2] = {16000, 50000};
    uint64_t hash = 0;
    int i, threads;
    for (i = 0; i < 2; i++)
        for (threads = 1; threads <= 3; threads += 2) {
            shape s;
            mesher_domain d;
            mesher_surface surface;
            mesher_options o;
            mesher_report r;
            memset(&s, 0, sizeof s);
            gyroid(&s, nodes[i], 1e-9);
            surface = surface_of(&s);
            memset(&o, 0, sizeof o);
            memset(&r, 0, sizeof r);
            o.max_tets = 4 * most[i];
            o.host.num_threads = threads;
            CHECK(mesher_mesh(&d, &surface, &o, &r) == MESHER_OK);
            CHECK(r.num_tets < most[i] && r.counts[MESHER_NOTE_FLIPPED_TRIANGLE] == 0);
            CHECK(delaunay_validate(&d.mesh, DELAUNAY_VALIDATE_GEOMETRY, NULL) == DELAUNAY_OK);
            if (threads == 1) hash = mesh_hash(&d);
            CHECK(mesh_hash(&d) == hash);
            mesher_domain_free(&d);
            shape_free(&s);
        }
}

/* A box whose top is a grid of n x n squares and whose other faces have as few triangles as can be:
 * four corners, then the nodes of the top. */
static void fine_top(mesher_surface *surface, double *xyz, uint32_t *triangles, uint32_t n)
{
    const uint32_t row = n + 1, top = 4;
    uint32_t i, j, *t = triangles;
    for (i = 0; i < 4; i++) {
        xyz[3 * i] = i == 1 || i == 2;
        xyz[3 * i + 1] = i > 1;
        xyz[3 * i + 2] = 0;
    }
    for (i = 0; i < row * row; i++) {
        xyz[3 * (top + i)] = (double)(i % row) / n;
        xyz[3 * (top + i) + 1] = (double)(i / row) / n;
        xyz[3 * (top + i) + 2] = 1;
    }
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++) {
            uint32_t v = top + row * j + i, turn = (i + j) & 1;
            *t++ = v, *t++ = v + 1, *t++ = turn ? v + row : v + row + 1;
            *t++ = turn ? v + 1 : v, *t++ = v + row + 1, *t++ = v + row;
        }
    *t++ = 0, *t++ = 2, *t++ = 1, *t++ = 0, *t++ = 3, *t++ = 2;
    for (j = 0; j < 4; j++) { /* side j, from corner j to the next */
        static const int step[4][2] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
        uint32_t b = (j + 1) & 3, v = top + (j == 1 || j == 2 ? n : 0) + (j > 1 ? row * n : 0);
        *t++ = j, *t++ = b, *t++ = v;
        for (i = 0; i < n; i++) {
            uint32_t w = v + (uint32_t)(step[j][0] + (int)row * step[j][1]);
            *t++ = b, *t++ = w, *t++ = v;
            v = w;
        }
    }
    memset(surface, 0, sizeof *surface);
    surface->xyz = xyz;
    surface->num_vertices = top + row * row;
    surface->triangles = triangles;
    surface->num_triangles = 2 * n * n + 2 + 4 * (n + 1);
}

/* Where sizes grow steeply from a fine face, the first vertices inside are as near to it as its
 * triangles want, although the sphere's centre of a tetrahedron from there to the next vertex is
 * too near to that one. */
static void steep_sizes_are_honoured(void)
{
    enum { N = 48 };
    static double xyz[3 * (4 + (N + 1) * (N + 1))];
    static uint32_t triangles[3 * (2 * N * N + 2 + 4 * (N + 1))];
    mesher_surface surface;
    mesher_domain d;
    mesher_report r;
    mesher_output out;
    uint64_t i, all = 0, far = 0;
    fine_top(&surface, xyz, triangles, N);
    memset(&r, 0, sizeof r);
    CHECK(mesher_mesh(&d, &surface, NULL, &r) == MESHER_OK);
    CHECK(r.size_in_band > 0.6);
    CHECK(mesher_export(&d, &out) == MESHER_OK);
    for (i = 0; i < out.num_tets; i++) { /* those with a facet in the top: where is the apex? */
        double z[4], low = 1;
        int k, on_top = 0;
        for (k = 0; k < 4; k++) {
            z[k] = out.xyz[3 * out.tets[4 * i + (uint64_t)k] + 2];
            on_top += z[k] == 1;
            low = z[k] < low ? z[k] : low;
        }
        if (on_top != 3) continue;
        all++;
        far += 1 - low > 4. / N;
    }
    CHECK(all > N * N && far * 20 < all);
    mesher_output_free(&d, &out);
    mesher_domain_free(&d);
}

/* A real part, end to end, with sizes of its own and a size function. */
static void a_part_is_the_same_for_any_number_of_threads(void)
{
    static const int threads[4] = {1, 2, 3, 8};
    uint64_t hash[2] = {0, 0};
    int kind = BALL_WISH, k;
    meshio_mesh part;
    memset(&part, 0, sizeof part);
    CHECK(demo_part_make(&part, 1));
    for (k = 0; k < 8; k++) {
        mesher_domain d;
        mesher_surface surface;
        mesher_options o;
        mesher_report r;
        memset(&surface, 0, sizeof surface);
        memset(&o, 0, sizeof o);
        memset(&r, 0, sizeof r);
        surface.xyz = part.xyz;
        surface.num_vertices = part.num_vertices;
        surface.triangles = part.triangles;
        surface.num_triangles = part.num_triangles;
        o.host.num_threads = threads[k / 2];
        o.size_factor = 0.75;/* enough points for several sections */
        if (k == 3 || k == 7) continue; /* the function with 1 and 3 threads */
        if (k & 1) {
            o.size_function = wish;
            o.size_user = &kind;
        }
        CHECK(mesher_mesh(&d, &surface, &o, &r) == MESHER_OK);
        CHECK(r.refined_vertices > 14000);
        if (k < 2) hash[k] = mesh_hash(&d);
        CHECK(mesh_hash(&d) == hash[k & 1]);
        mesher_domain_free(&d);
    }
    CHECK(hash[0] != hash[1]);
    meshio_free(&part);
}

/* Meshes with as many slots as tetrahedra, which is what nobody else has: reads beyond the last one
 * are for the address sanitizer to see, where the block ends with it. */
static void meshes_of_any_size_are_refined(void)
{
    double xyz[3 * 80];
    uint32_t n;
    int k;
    small_state = 88172645463325252u;
    for (n = 20; n < 80; n++) {
        delaunay_mesh m;
        mesher_domain d;
        mesher_surface s;
        mesher_options o;
        mesher_report r;
        uint32_t *tets;
        size_t count;
        memset(&m, 0, sizeof m);
        memset(&s, 0, sizeof s);
        memset(&o, 0, sizeof o);
        memset(&r, 0, sizeof r);
        for (k = 0; k < 3 * (int)n; k++) xyz[k] = small_random(1000000) * 1e-6;
        CHECK(delaunay_tetrahedralize(&m, xyz, n, NULL, NULL) == DELAUNAY_OK);
        count = (size_t)delaunay_count_tets(&m);
        tets = (uint32_t *)malloc(4 * count * sizeof *tets);
        delaunay_export_tets(&m, tets, count);
        delaunay_mesh_free(&m);
        s.xyz = xyz;
        s.num_vertices = n;
        for (k = 2; k < 6; k++) { /* from many points to next to none */
            o.size = 0.1 * k;
            CHECK(mesher_refine_mesh(&d, &s, tets, NULL, count, &o, &r) == MESHER_OK);
            CHECK(r.num_tets >= count && (k > 2 || r.refined_vertices > 0));
            CHECK(delaunay_validate(&d.mesh, DELAUNAY_VALIDATE_GEOMETRY, NULL) == DELAUNAY_OK);
            mesher_domain_free(&d);
        }
        free(tets);
    }
}

/* Copies the vertices of a mesh, and its tetrahedra, into new arrays. */
static void copy_mesh(const delaunay_mesh *m, mesher_surface *surface, mesher_output *out)
{
    double *xyz;
    uint32_t i;
    int k;
    surface->num_vertices = m->num_vertices - 1;
    surface->xyz = xyz = (double *)malloc(3 * surface->num_vertices * sizeof(double));
    out->tets = (uint32_t *)malloc(4 * (size_t)m->num_tets * sizeof(uint32_t));
    out->regions = (uint32_t *)malloc((size_t)m->num_tets * sizeof(uint32_t));
    for (i = 1; i < m->num_vertices; i++)
        memcpy(xyz + 3 * (i - 1), m->vertices[i].x, 3 * sizeof(double));
    for (i = 1; i < m->num_tets; i++) {
        if (delaunay_is_deleted(m, i)) continue;
        for (k = 0; k < 4; k++) out->tets[4 * out->num_tets + (uint64_t)k] = m->tets[i].v[k] - 1;
        out->regions[out->num_tets++] = m->color[i];
    }
}

/* A mesh that is there already: kept as it is without a wish, refined with one; its surface must be
 * in it. */
static void a_finished_mesh_is_refined(void)
{
    mesher_domain d, e;
    mesher_output out;
    mesher_surface surface;
    mesher_options o;
    mesher_report r;
    mesher_finding finding;
    mesher_source ball;
    uint32_t bad[3] = {0, 1, 0}, i;
    memset(&o, 0, sizeof o);
    memset(&surface, 0, sizeof surface);
    memset(&r, 0, sizeof r);
    memset(&ball, 0, sizeof ball);
    memset(&out, 0, sizeof out);
    o.size = 0.5;
    CHECK(box(&d, 3, 2, 2, 1, 1, &o));
    CHECK(refine_and_check(&d, &r) == MESHER_OK);
    copy_mesh(&d.mesh, &surface, &out);
    o.size = 0;
    ball.size = 0.05;
    ball.radius = 0.2;
    ball.xyz[0] = ball.xyz[1] = ball.xyz[2] = 1.0;
    for (i = 0; i < 2; i++) {
        mesher_result result;
        o.num_sources = i;
        o.sources = &ball;
        result =
            mesher_refine_mesh(&e, &surface, out.tets, out.regions, (size_t)out.num_tets, &o, &r);
        CHECK(result == MESHER_OK);
        CHECK(i ? r.refined_vertices > 300 : r.refined_vertices < 20);
        CHECK(r.num_regions == 2 && e.num_regions == 2);
        CHECK(r.counts[MESHER_NOTE_UNUSED_VERTEX] == 0); /* those inside are in tetrahedra */
        CHECK(mesher_color(&e, &r) == MESHER_ERROR_INVALID_ARGUMENT); /* numbers are the caller's */
        CHECK(fabs(e.regions[0].volume - 4) < 1e-9 && fabs(e.regions[1].volume - 8) < 1e-9);
        CHECK(surface_hash(&e) == surface_hash(&d));
        CHECK(delaunay_validate(&e.mesh, DELAUNAY_VALIDATE_GEOMETRY, NULL) == DELAUNAY_OK);
        mesher_domain_free(&e);
    }
    out.regions[0] = 0; /* no number of a region */
    CHECK(mesher_refine_mesh(&e, &surface, out.tets, out.regions, (size_t)out.num_tets, &o, &r) ==
          MESHER_ERROR_INVALID_ARGUMENT);
    CHECK(mesher_refine_mesh(&e, &surface, NULL, NULL, 0, &o, &r) ==
          MESHER_ERROR_INVALID_ARGUMENT);
    CHECK(strstr(r.message, "no tetrahedra"));
    mesher_domain_free(&e); /* zeroed */
    bad[2] = (uint32_t)surface.num_vertices - 1; /* no facet of the mesh */
    surface.triangles = bad;
    surface.num_triangles = 1;
    CHECK(mesher_refine_mesh(&e, &surface, out.tets, NULL, (size_t)out.num_tets, &o, &r) ==
          MESHER_ERROR_SURFACE);
    CHECK(strstr(r.message, "is not in the mesh") && r.counts[MESHER_DEFECT_NOT_IN_MESH] == 1);
    surface.num_triangles = 0;
    surface.edges = bad + 1; /* no edge of it */
    surface.num_edges = 1;
    r.findings = &finding;
    r.cap_findings = 1;
    CHECK(mesher_refine_mesh(&e, &surface, out.tets, NULL, (size_t)out.num_tets, &o, &r) ==
          MESHER_ERROR_SURFACE);
    CHECK(r.num_findings == 1 && finding.kind == MESHER_DEFECT_NOT_IN_MESH);
    CHECK(finding.triangles[0] == 0 && finding.vertices[0] + finding.vertices[1] == 1 + bad[2] &&
          finding.vertices[2] == DELAUNAY_NO_ID);
    free((void *)surface.xyz);
    free(out.tets);
    free(out.regions);
    mesher_domain_free(&d);
}

/* Cubes of six tetrahedra each at the dark corners of a 2x2x2 chessboard: they meet in edges, and
 * all in the middle. With parted, each has vertices of its own at the same places. */
enum { CHESS_TETS = 24, CHESS_FACETS = 48 };
typedef struct chess {
    double   xyz[3 * 32];
    uint32_t num_vertices, tets[4 * CHESS_TETS], triangles[3 * CHESS_FACETS], num_triangles;
} chess;

static void make_chess(chess *c, int parted)
{
    static const uint8_t path[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2},
                                       {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
    static const uint8_t cubes[4][3] = {{0, 0, 0}, {1, 1, 0}, {1, 0, 1}, {0, 1, 1}};
    uint32_t cube, corner, p, k, i, v, number[8];
    memset(c, 0, sizeof *c);
    for (cube = 0; cube < 4; cube++) {
        for (corner = 0; corner < 8; corner++) {
            double x[3];
            for (k = 0; k < 3; k++) x[k] = cubes[cube][k] + (corner >> k & 1);
            for (v = 0; v < c->num_vertices && !parted; v++)
                if (memcmp(c->xyz + 3 * v, x, sizeof x) == 0) break;
            if (parted) v = c->num_vertices;
            memcpy(c->xyz + 3 * v, x, sizeof x);
            if (v == c->num_vertices) c->num_vertices++;
            number[corner] = v;
        }
        for (p = 0; p < 6; p++) {
            uint32_t *t = c->tets + 24 * cube + 4 * p, at = 0;
            for (k = 0; k < 4; k++) {
                t[k] = number[at];
                if (k < 3) at |= 1u << path[p][k];
            }
            if (p == 1 || p == 2 || p == 5) { /* all of one orientation */
                t[2] ^= t[3];
                t[3] ^= t[2];
                t[2] ^= t[3];
            }
        }
        for (k = 0; k < 6; k++) { /* the diagonals of the paths */
            uint32_t a = 1u << k % 3, b = 1u << (k + 1) % 3, o = k < 3 ? 0 : 7 - a - b;
            uint32_t *t = c->triangles + 3 * c->num_triangles;
            for (i = 0; i < 2; i++) t[3 * i] = number[o], t[3 * i + 2] = number[o + a + b];
            t[1] = number[o + a], t[4] = number[o + b];
            c->num_triangles += 2;
        }
    }
}

/* Is the edge with these input vertices marked in all tetrahedra that have it? Their number: *n. */
static int marked_everywhere(const mesher_domain *d, uint32_t a, uint32_t b, int *n)
{
    const delaunay_mesh *m = &d->mesh;
    delaunay_handle t;
    int all = 1;
    *n = 0;
    for (t = 1; t < m->num_tets; t++) {
        int i = delaunay_local_index(&m->tets[t], m->vertex_of[a]);
        int j = delaunay_local_index(&m->tets[t], m->vertex_of[b]);
        if (delaunay_is_deleted(m, t) || i < 0 || j < 0) continue;
        ++*n;
        all &= (m->flags[t] & DELAUNAY_EDGE_BIT(delaunay_edge_between(i, j))) != 0;
    }
    return all;
}

static uint64_t hash_output(const mesher_output *out)
{
    uint64_t h = UINT64_C(0xcbf29ce484222325), i;
    const unsigned char *bytes = (const unsigned char *)out->xyz;
    for (i = 0; i < 24 * out->num_vertices; i++) h = (h ^ bytes[i]) * UINT64_C(0x100000001b3);
    for (i = 0; i < 4 * out->num_tets; i++) h = (h ^ out->tets[i]) * UINT64_C(0x100000001b3);
    return h;
}

/* Parts of a mesh that touch in an edge or a vertex only: their stars are in several parts. */
static void parts_that_touch_are_refined(void)
{
    static chess c;
    mesher_surface s;
    mesher_options o;
    mesher_report r;
    mesher_domain d, e;
    mesher_output out;
    uint64_t first = 0;
    uint32_t line[2], i;
    int threads, n, parted;
    memset(&o, 0, sizeof o);
    memset(&r, 0, sizeof r);
    for (parted = 0; parted < 2; parted++)
        for (threads = 1; threads <= 3; threads += 2) {
            make_chess(&c, parted);
            memset(&s, 0, sizeof s);
            memset(&out, 0, sizeof out);
            s.xyz = c.xyz;
            s.num_vertices = c.num_vertices;
            s.triangles = c.triangles;
            s.num_triangles = c.num_triangles;
            s.edges = line; /* of one cube, from its corner through its inside */
            s.num_edges = 1;
            line[0] = c.tets[0], line[1] = c.tets[3];
            o.host.num_threads = threads;
            o.size = 0.2;
            o.no_refine = 1;
            CHECK(mesher_refine_mesh(&d, &s, c.tets, NULL, CHESS_TETS, &o, &r) == MESHER_OK);
            CHECK(marked_everywhere(&d, line[0], line[1], &n) && n == 6);
            for (i = 0; i < 3 * c.num_triangles; i++) {
                uint32_t next = i % 3 < 2 ? i + 1 : i - 2;
                CHECK(marked_everywhere(&d, c.triangles[i], c.triangles[next], &n) && n > 0);
            }
            CHECK(delaunay_validate(&d.mesh, DELAUNAY_VALIDATE_GEOMETRY, NULL) == DELAUNAY_OK);
            mesher_domain_free(&d);
            o.no_refine = 0;
            CHECK(mesher_refine_mesh(&d, &s, c.tets, NULL, CHESS_TETS, &o, &r) == MESHER_OK);
            CHECK(r.refined_vertices > 200 && marked_everywhere(&d, line[0], line[1], &n));
            CHECK(delaunay_validate(&d.mesh, DELAUNAY_VALIDATE_GEOMETRY, NULL) == DELAUNAY_OK);
            CHECK(fabs(small_total(&d.mesh) - 24) < 1e-11); /* six times the volume */
            CHECK(mesher_export(&d, &out) == MESHER_OK);
            if (threads == 1) first = hash_output(&out);
            CHECK(hash_output(&out) == first);
            CHECK(out.num_triangles == c.num_triangles && out.num_edges == 1);
            for (i = 0; i < out.num_triangles; i++) /* the region on one side, nothing beyond */
                CHECK(out.triangle_regions[2 * i] + out.triangle_regions[2 * i + 1] == 1);
            o.size = 0.12; /* and once more */
            s.xyz = out.xyz;
            s.num_vertices = (size_t)out.num_vertices;
            CHECK(mesher_refine_mesh(&e, &s, out.tets, out.regions, (size_t)out.num_tets, &o, &r) ==
                  MESHER_OK);
            CHECK(r.refined_vertices > 200 && r.num_regions == 1);
            CHECK(delaunay_validate(&e.mesh, DELAUNAY_VALIDATE_GEOMETRY, NULL) == DELAUNAY_OK);
            mesher_domain_free(&e);
            mesher_output_free(&d, &out);
            mesher_domain_free(&d);
        }
}

/* Any numbers but 0, however far apart. */
static void regions_of_any_number(void)
{
    static const uint32_t numbers[4] = {UINT32_MAX, 7, 4000000000u, 1};
    static chess c;
    mesher_surface s;
    mesher_report r;
    mesher_domain d;
    uint32_t regions[CHESS_TETS], i;
    make_chess(&c, 0);
    memset(&s, 0, sizeof s);
    memset(&r, 0, sizeof r);
    s.xyz = c.xyz;
    s.num_vertices = c.num_vertices;
    for (i = 0; i < CHESS_TETS; i++) regions[i] = numbers[i / 6];
    CHECK(mesher_refine_mesh(&d, &s, c.tets, regions, CHESS_TETS, NULL, &r) == MESHER_OK);
    CHECK(r.num_regions == 4 && d.num_regions == 4);
    for (i = 0; i < d.num_regions; i++) {
        static const uint32_t sorted[4] = {1, 7, 4000000000u, UINT32_MAX};
        CHECK(d.regions[i].number == sorted[i] && d.regions[i].num_tets == 6);
        CHECK(fabs(d.regions[i].volume - 1) < 1e-12);
    }
    mesher_domain_free(&d);
    regions[17] = 0;
    CHECK(mesher_refine_mesh(&d, &s, c.tets, regions, CHESS_TETS, NULL, &r) ==
          MESHER_ERROR_INVALID_ARGUMENT);
    CHECK(strstr(r.message, "tetrahedron 17 has region number 0"));
    c.xyz[5] = (double)NAN;
    CHECK(mesher_refine_mesh(&d, &s, c.tets, NULL, CHESS_TETS, NULL, &r) == MESHER_ERROR_SURFACE);
    CHECK(strstr(r.message, "vertex 1"));
}

#if defined(MESHER__SIMD)
/* What four lanes call small is small for the plain way too, however flat it is: corners of
 * rectangles are on a circle but for rounding, and so on any sphere. */
static void quick_answers_are_those_of_the_plain_way(void)
{
    int trial, i, k, little, found = 0;
    if (!__builtin_cpu_supports("avx2")) return;
    for (trial = 0; trial < 100000; trial++) {
        delaunay_vertex room[6], *v = room; /* 32 bytes each, and on a multiple of that */
        delaunay_tet t[4];
        const delaunay_tet *all[4];
        double size[5], x[3], bound = mesher__bound(16, 4), height = pow(0.1, small_random(25));
        while ((uintptr_t)v % 32) v = (delaunay_vertex *)(void *)((char *)v + 8);
        memset(t, 0, sizeof t);
        for (i = 0; i < 5; i++) {
            size[i] = 4;
            for (k = 0; k < 3; k++) v[i].x[k] = 1e-6 * small_random(1000000);
        }
        for (k = 0; k < 3; k++) { /* v[2] - v[1] is at a right angle to v[3] - v[1] */
            int j = (k + 1) % 3, l = (k + 2) % 3;
            x[k] = v[2].x[j] * v[3].x[l] - v[2].x[l] * v[3].x[j];
        }
        for (k = 0; k < 3; k++) {
            v[2].x[k] += v[1].x[k];
            v[3].x[k] = v[1].x[k] + x[k];
            v[4].x[k] = v[2].x[k] + x[k] + height * v[4].x[k];
        }
        for (i = 0; i < 4; i++) {
            for (k = 0; k < 4; k++) t[i].v[k] = (uint32_t)(i + k) % 4 + 1;
            if (i & 1) { /* as positive as the others */
                t[i].v[0] = (uint32_t)(i + 1) % 4 + 1;
                t[i].v[1] = (uint32_t)i % 4 + 1;
            }
            all[i] = &t[i];
        }
        little = mesher__are_small4(v, size, all);
        for (i = 0; i < 4; i++) {
            const uint32_t *w = t[i].v;
            double rr = mesher__circumcentre(v[w[0]].x, v[w[1]].x, v[w[2]].x, v[w[3]].x, x);
            found += little >> i & 1;
            CHECK(!(little >> i & 1) || (rr >= 0 && rr < bound * bound));
        }
    }
    CHECK(found > 1000);
}
#endif

/* A fine ball in a large coarse one: a bound of the sizes adds what the coarse part needs, and does
 * not make those between finer. */
static void a_bound_does_not_refine_what_is_below_it(void)
{
    static const double volume = 4.18879 * 50 * 50 * 50, bound = 6;
    uint64_t tets[3];
    int k;
    for (k = 0; k < 3; k++) {
        shape s;
        mesher_surface surface;
        mesher_domain d;
        mesher_options o;
        mesher_report r;
        memset(&s, 0, sizeof s);
        memset(&o, 0, sizeof o);
        memset(&r, 0, sizeof r);
        if (k == 1) o.size = bound;
        if (k == 2) o.max_size = bound;
        sphere(&s, 0, 1, 24);
        sphere(&s, 0, 50, 12);
        surface = surface_of(&s);
        CHECK(mesher_mesh(&d, &surface, &o, &r) == MESHER_OK);
        CHECK(r.size_in_band > 0.85);
        tets[k] = r.num_tets;
        mesher_domain_free(&d);
        shape_free(&s);
    }
    CHECK(tets[1] > tets[0] && tets[1] == tets[2]);
    CHECK((double)tets[1] < 1.3 * ((double)tets[0] + volume / (0.118 * bound * bound * bound)));
}

static int by_key(const void *a, const void *b)
{
    const uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return x < y ? -1 : x > y;
}

/* The share of the edges with an end from first_new on, each counted once, that are about as long
 * as wanted. */
static double share_in_band(const mesher_domain *d, uint32_t first_new)
{
    const delaunay_mesh *mesh = &d->mesh;
    uint64_t *keys = (uint64_t *)malloc(6 * (size_t)mesh->num_tets * sizeof *keys);
    size_t n = 0, i, edges = 0, in_band = 0;
    delaunay_handle t;
    int e, k;
    if (!keys) return -1;
    for (t = 1; t < mesh->num_tets; t++)
        for (e = 0; e < 6 && !delaunay_is_deleted(mesh, t) && mesh->color[t]; e++) {
            uint32_t a = mesh->tets[t].v[delaunay_edge_order(e)[0]],
                     b = mesh->tets[t].v[delaunay_edge_order(e)[1]];
            if (a >= first_new || b >= first_new)
                keys[n++] = a < b ? (uint64_t)a << 32 | b : (uint64_t)b << 32 | a;
        }
    qsort(keys, n, sizeof *keys, by_key);
    for (i = 0; i < n; i++) {
        const uint32_t a = (uint32_t)(keys[i] >> 32), b = (uint32_t)keys[i];
        double length = 0, ratio;
        if (i > 0 && keys[i] == keys[i - 1]) continue;
        for (k = 0; k < 3; k++)
            length += (mesh->vertices[a].x[k] - mesh->vertices[b].x[k]) *
                      (mesh->vertices[a].x[k] - mesh->vertices[b].x[k]);
        ratio = 2 * sqrt(length) / (d->size[a] + d->size[b]);
        edges++;
        in_band += ratio >= 0.7 && ratio <= 1.4;
    }
    free(keys);
    return (double)in_band / (double)edges;
}

static void every_edge_counts_once(void)
{
    mesher_domain d;
    mesher_report r;
    mesher_options o;
    uint32_t first_new;
    int k;
    memset(&o, 0, sizeof o);
    for (k = 0; k < 2; k++) {
        o.size = k ? 0.4 : 0.7;
        CHECK(box(&d, 5, 4, 3, 1, 2, &o));
        first_new = d.mesh.num_vertices;
        CHECK(refine_and_check(&d, &r) == MESHER_OK);
        CHECK(d.mesh.num_tets < 10000 && r.refined_vertices > 0);
        CHECK(fabs(r.size_in_band - share_in_band(&d, first_new)) < 1e-9);
        mesher_domain_free(&d);
    }
}

/* Sizes far larger than the triangles under them do not leave a ball one point in its middle: they
 * are at most twice the default's there, and grow inwards by no more than 1.7. */
static void sizes_do_not_leave_the_surface_behind(void)
{
    static double xyz[3 * 2000], huge[2000];
    static uint32_t triangles[3 * 4000];
    uint64_t hash[5];
    int way;
    for (way = 0; way < 2000; way++) huge[way] = 100;
    for (way = 0; way < 5; way++) {
        mesher_domain d;
        mesher_surface surface;
        mesher_options o;
        mesher_report r;
        uint32_t nv, nt = ball_of(4, xyz, triangles, &nv);
        surface = ball_surface(xyz, nv, triangles, nt);
        memset(&o, 0, sizeof o);
        memset(&r, 0, sizeof r);
        if (way < 2) o.size_factor = way ? 5 : 2;
        else if (way == 2) o.vertex_sizes = huge;
        else o.growth = way == 3 ? 1.7 : 3;
        CHECK(mesher_mesh(&d, &surface, &o, &r) == MESHER_OK);
        CHECK(r.refined_vertices > 50);
        hash[way] = mesh_hash(&d);
        mesher_domain_free(&d);
    }
    CHECK(hash[1] == hash[0] && hash[2] == hash[0] && hash[3] != hash[0] && hash[4] == hash[3]);
}

/* The least of what the surface's vertices allow at x with growth 1.3. */
static double grown(const mesher_domain *d, const double *x)
{
    double least = HUGE_VAL;
    uint32_t v;
    int k;
    for (v = 1; v < d->mesh.num_vertices; v++) {
        double sum = 0, h;
        if (d->mesh.vertex_id[v] == DELAUNAY_NO_ID) continue;
        for (k = 0; k < 3; k++)
            sum += (x[k] - d->mesh.vertices[v].x[k]) * (x[k] - d->mesh.vertices[v].x[k]);
        h = d->size[v] + 0.3 * sqrt(sum);
        if (h < least) least = h;
    }
    return least;
}

/* On a fine surface, too, whose empty mesh has tetrahedra with far apart corners, the sizes of all
 * points are those that grow from the vertices around them; so there are many points. */
static void sizes_grow_from_fine_surfaces(void)
{
    static double xyz[3 * 5000];
    static uint32_t triangles[3 * 9000];
    mesher_domain d;
    mesher_surface surface;
    mesher_options o;
    mesher_report r;
    uint32_t nv, nt = ball_of(5, xyz, triangles, &nv), v, wrong = 0;
    surface = ball_surface(xyz, nv, triangles, nt);
    memset(&o, 0, sizeof o);
    memset(&r, 0, sizeof r);
    o.growth = 1.3;
    o.size = 0.2; /* in the middle a lattice */
    CHECK(nv <= 5000 && nt <= 9000);
    CHECK(mesher_mesh(&d, &surface, &o, &r) == MESHER_OK);
    CHECK(r.refined_vertices > nv / 3);
    for (v = 1; v < d.mesh.num_vertices; v++) {
        double h;
        if (d.mesh.vertex_id[v] != DELAUNAY_NO_ID) continue;
        h = grown(&d, d.mesh.vertices[v].x);
        if (h > o.size) h = o.size;
        wrong += d.size[v] < 0.95 * h || d.size[v] > 1.2 * h;
    }
    CHECK(wrong == 0);
    if (wrong) printf("%u sizes\n", wrong);
    mesher_domain_free(&d);
}

#if !defined(LINKED)
/* The tree of sizes that grow answers as a loop over all vertices of the region does. */
static void the_tree_of_sizes_finds_the_least(void)
{
    mesher_domain d;
    mesher__growth g;
    hilbert_box cube;
    uint32_t v, t;
    int k, i, at_border = 0;
    CHECK(box(&d, 6, 5, 4, 1, 2, NULL));
    for (k = 0; k < 3; k++) {
        cube.lo[k] = -1;
        cube.hi[k] = 9;
    }
    CHECK(mesher_size(&d, NULL) == MESHER_OK);
    for (v = 1; v < d.mesh.num_vertices; v++)
        d.size[v] = v % 7 == 0 ? 0 : 0.1 + 2 * random_unit();
    CHECK(mesher__growth_init(&g, &d, &d.mesh.memory, &cube) == MESHER_OK);
    for (k = 0; k < 300; k++) {
        double x[3], least = HUGE_VAL, found;
        const uint32_t region = 1 + (uint32_t)(k & 1);
        for (i = 0; i < 3; i++) x[i] = 7 * random_unit() - 0.5;
        for (t = 1; t < d.mesh.num_tets; t++)
            for (i = 0; i < 4 && d.mesh.color[t] == region; i++) {
                const double *y = d.mesh.vertices[d.mesh.tets[t].v[i]].x;
                const double size = d.size[d.mesh.tets[t].v[i]];
                const double h = size + 0.4 * mesher__distance(x, y);
                if (size > 0 && h < least) least = h;
            }
        found = mesher__grown_size(&g, x, region, 0.4, 1e300);
        CHECK(found >= least && found <= 1.11 * least);
        CHECK(mesher__grown_size(&g, x, region, 0.4, 0.05) == 0.05);
        at_border += mesher__grown_size(&g, x, 3 - region, 0.4, 1e300) > 1.11 * least;
    }
    CHECK(at_border > 50); /* the regions have different answers */
    CHECK(mesher__grown_size(&g, d.mesh.vertices[1].x, 77, 0.4, 5) == 5);
    mesher__growth_free(&d.mesh.memory, &g);
    mesher_domain_free(&d);
}
#endif

/* How many tetrahedra are flat: their least height is below a fifth of their longest edge. */
static uint32_t flat_ones(const delaunay_mesh *m)
{
    delaunay_handle t;
    uint32_t n = 0;
    for (t = 1; t < m->num_tets; t++) {
        const double *x[4];
        double area = 0, longest = 0, volume = 0;
        int i, j;
        if (delaunay_is_ghost(m, t) || m->color[t] != 1) continue;
        for (i = 0; i < 4; i++) x[i] = m->vertices[m->tets[t].v[i]].x;
        for (i = 0; i < 4; i++) {
            double e[3][3], c[3], l = 0;
            for (j = 0; j < 9; j++)
                e[j / 3][j % 3] = x[(i + 1 + j / 3) & 3][j % 3] - x[i][j % 3];
            for (j = 0; j < 3; j++) {
                c[j] = e[0][(j + 1) % 3] * e[1][(j + 2) % 3] -
                       e[0][(j + 2) % 3] * e[1][(j + 1) % 3];
                l += e[0][j] * e[0][j];
            }
            volume = fabs(c[0] * e[2][0] + c[1] * e[2][1] + c[2] * e[2][2]);
            if (l > longest) longest = l;
            l = c[0] * c[0] + c[1] * c[1] + c[2] * c[2];
            if (l > area) area = l;
        }
        n += volume < 0.2 * sqrt(longest * area);
    }
    return n;
}

/* A rod of radius 0.7; its edges are 0.7 and 0.92 long. */
static void hexagonal_rod(mesher_surface *surface, double *xyz, uint32_t *triangles, uint32_t rings)
{
    uint32_t k, i, n = 0;
    for (k = 0; k < rings; k++)
        for (i = 0; i < 6; i++) {
            const double angle = (i + 0.5 * (k & 1)) * 1.0471975511965976;
            double *x = xyz + 3 * (6 * k + i);
            const uint32_t a = 6 * k + i, b = 6 * k + (i + 1) % 6, up = a + 6, next = b + 6;
            x[0] = 0.7 * cos(angle);
            x[1] = 0.7 * sin(angle);
            x[2] = 0.85 * k;
            if (k + 1 == rings) continue;
            triangles[n++] = a;
            triangles[n++] = b;
            triangles[n++] = k & 1 ? next : up;
            triangles[n++] = k & 1 ? a : b;
            triangles[n++] = next;
            triangles[n++] = up;
        }
    for (i = 0; i < 2; i++) {
        double *x = xyz + 3 * (6 * rings + i);
        x[0] = x[1] = 0;
        x[2] = i ? 0.85 * (rings - 1) : 0;
        for (k = 0; k < 6; k++) {
            const uint32_t first = i ? 6 * (rings - 1) : 0;
            triangles[n++] = 6 * rings + i;
            triangles[n++] = first + (i ? k : (k + 1) % 6);
            triangles[n++] = first + (i ? (k + 1) % 6 : k);
        }
    }
    memset(surface, 0, sizeof *surface);
    surface->xyz = xyz;
    surface->num_vertices = 6 * rings + 2;
    surface->triangles = triangles;
    surface->num_triangles = n / 3;
}

/* The axis of a rod gets points, although they are nearer to the surface than its size asks for:
 * without them a sixth of the tetrahedra is flat. */
static void thin_places_get_points(void)
{
    static double xyz[3 * 300];
    static uint32_t triangles[3 * 600];
    uint64_t hash[2];
    int k;
    for (k = 0; k < 2; k++) {
        mesher_domain d;
        mesher_surface surface;
        mesher_options o;
        mesher_report r;
        hexagonal_rod(&surface, xyz, triangles, 40);
        memset(&o, 0, sizeof o);
        memset(&r, 0, sizeof r);
        o.host.num_threads = 1 + 2 * k;
        CHECK(mesher_mesh(&d, &surface, &o, &r) == MESHER_OK);
        CHECK(r.refined_vertices > 30);
        CHECK(flat_ones(&d.mesh) == 0);
        hash[k] = mesh_hash(&d);
        mesher_domain_free(&d);
    }
    CHECK(hash[0] == hash[1]);
}

int main(void)
{
#if defined(MESHER__SIMD)
    quick_answers_are_those_of_the_plain_way();
#endif
    meshes_of_any_size_are_refined();
    a_finished_mesh_is_refined();
    parts_that_touch_are_refined();
    regions_of_any_number();
    a_part_is_the_same_for_any_number_of_threads();
    a_ball_end_to_end();
    large_cavities_are_cut(5, 0.02, 0.25, 0);
    large_cavities_are_cut(5, 0.3, 0.25, 1);
    small_corners_do_not_fill_a_plate();
    small_sizes_get_a_lattice();
#if !defined(PARALLEL_ONLY) /* tsan.sh: long ones that show nothing about threads are left out */
    needles_do_not_hold_up();
    specks_do_not_hold_up();
    failing_allocations_leave_a_valid_mesh();
#endif
    steep_sizes_are_honoured();
    one_cube_gets_the_wanted_size();
    a_fine_surface_is_honoured();
    a_plate_of_one_layer_gets_no_points();
    an_interface_and_its_colours_stay();
    outside_is_never_refined();
    an_embedded_line_stays();
    size_functions_of_every_kind();
    distances_to_shapes();
    sources_have_their_sizes();
    regions_and_vertices_have_their_sizes();
    a_grid_of_sizes();
    a_mesh_of_sizes();
    bad_meshes_of_sizes_are_refused();
    a_mesh_that_has_grown_is_refined();
    a_size_may_underflow();
    layers_between_facets();
    small_sources_are_seen();
    steep_sources_are_seen();
    steep_fields_are_seen();
    regions_share_their_border();
    flat_is_not_curved();
    a_factor_scales_all_sizes();
    nonsense_is_refused();
    bounds_and_gradation();
    slow_growth_reaches_far();
    sizes_have_a_floor();
    sizes_that_ask_for_far_too_much_are_told();
    a_memory_limit_is_used_up();
    budgets_leave_a_valid_mesh();
    a_raised_budget_lets_it_go_on();
    a_cancelled_mesh_is_valid();
    threads_give_the_same_bytes();
    far_and_small_balls_are_refined();
#if !defined(LINKED)
    densities_of_linear_sizes();
#endif
    steep_sizes_that_ask_for_too_much_are_told();
    a_bound_does_not_refine_what_is_below_it();
    every_edge_counts_once();
    sizes_do_not_leave_the_surface_behind();
    sizes_grow_from_fine_surfaces();
    thin_places_get_points();
    curved_sides_have_their_sizes();
#if !defined(LINKED)
    the_tree_of_sizes_finds_the_least();
#endif
    return check_report();
}
