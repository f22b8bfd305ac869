/* test_divide.c - the division of surfaces before they are meshed: lengths of edges, shape, tags,
 * lines, rings of many triangles, needles, budgets, failing allocations; and the meshes of divided
 * surfaces. */
#ifndef LINKED
#  define MESHER_IMPLEMENTATION
#endif
#include "mesher.h"
#include "check.h"
#include "shapes.h"
#include "small_mesh.h"

static mesher_options sized(double size)
{
    mesher_options o;
    memset(&o, 0, sizeof o);
    o.size = size;
    return o;
}

static const double *corner(const mesher_surface *s, size_t t, int k)
{
    return s->xyz + 3 * (size_t)s->triangles[3 * t + (size_t)k % 3];
}

static double length(const double *a, const double *b)
{
    double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
    return sqrt(x * x + y * y + z * z);
}

static void cross(const double *a, const double *b, const double *c, double *n)
{
    int k;
    for (k = 0; k < 3; k++) {
        int p = (k + 1) % 3, q = (k + 2) % 3;
        n[k] = (b[p] - a[p]) * (c[q] - a[q]) - (b[q] - a[q]) * (c[p] - a[p]);
    }
}

static double area_of(const mesher_surface *s, size_t t)
{
    double n[3];
    cross(corner(s, t, 0), corner(s, t, 1), corner(s, t, 2), n);
    return sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]) / 2;
}

/* Of the whole surface: its area, the volume within, by its orientation, and its edges. */
typedef struct measures {
    double area, volume, longest, shortest, least_angle;
} measures;

static measures measure(const mesher_surface *s)
{
    measures m = {0, 0, 0, 1e300, 180};
    size_t t;
    int k;
    for (t = 0; t < s->num_triangles; t++) {
        const double *a = corner(s, t, 0);
        double n[3], area = area_of(s, t);
        cross(a, corner(s, t, 1), corner(s, t, 2), n);
        m.area += area;
        m.volume += (a[0] * n[0] + a[1] * n[1] + a[2] * n[2]) / 6;
        for (k = 0; k < 3; k++) {
            double l = length(corner(s, t, k), corner(s, t, k + 1));
            double r = length(corner(s, t, k), corner(s, t, k + 2)), angle;
            angle = asin(fmin(1, 2 * area / (l * r))) * 57.29577951308232;
            if (l > m.longest) m.longest = l;
            if (l < m.shortest) m.shortest = l;
            if (angle < m.least_angle) m.least_angle = angle;
        }
    }
    return m;
}

/* Every edge in two triangles, once in each direction. */
static int is_closed(const mesher_surface *s)
{
    size_t n = 3 * s->num_triangles, i;
    hxtsort_pair *sides = (hxtsort_pair *)malloc(n * sizeof *sides);
    int closed = n % 2 == 0;
    for (i = 0; i < n; i++) {
        uint64_t a = s->triangles[i], b = s->triangles[i % 3 == 2 ? i - 2 : i + 1];
        sides[i].key = a < b ? a << 32 | b : b << 32 | a;
        sides[i].value = a < b;
    }
    hxtsort_pairs(sides, n, NULL);
    for (i = 0; i + 1 < n; i += 2)
        closed &= sides[i].key == sides[i + 1].key && sides[i].value != sides[i + 1].value &&
                  (i + 2 == n || sides[i + 2].key != sides[i].key);
    free(sides);
    return closed;
}

static uint64_t meshed(const mesher_surface *s, double size, double *volume)
{
    mesher_domain domain;
    mesher_report report;
    mesher_options o = sized(size);
    uint64_t regions = 0;
    uint32_t i;
    memset(&report, 0, sizeof report);
    *volume = 0;
    if (mesher_mesh(&domain, s, &o, &report) == MESHER_OK) {
        CHECK(delaunay_validate(&domain.mesh, DELAUNAY_VALIDATE_GEOMETRY, NULL) == DELAUNAY_OK);
        CHECK(report.surface_steiner == 0);
        for (i = 0; i < domain.num_regions; i++) *volume += domain.regions[i].volume;
        regions = report.num_regions;
    } else printf("%s\n", report.message);
    mesher_domain_free(&domain);
    return regions;
}

/* A box of 12 triangles, upright or turned, so that rounding bends its planes. */
static void test_box(void)
{
    int turned;
    for (turned = 0; turned < 4; turned++) {
        shape s = {0};
        mesher_fine_surface fine;
        mesher_options o = sized(0.1);
        mesher_surface given;
        measures m;
        double volume;
        random_box(&s, 1, 1, 1, 1);
        transform(&s, 0.7 * turned, 1, turned);
        given = surface_of(&s);
        CHECK(mesher_refine_surface(&fine, &given, &o, NULL) == MESHER_OK);
        m = measure(&fine.surface);
        CHECK(memcmp(fine.xyz, s.xyz, 24 * sizeof *s.xyz) == 0);
        CHECK(m.longest <= 0.1 * 1.4143 && m.shortest > 0.04 && m.least_angle > 25);
        CHECK(fabs(m.area - 6) < 1e-12 && fabs(m.volume - 1) < 1e-12);
        CHECK(is_closed(&fine.surface));
        CHECK((double)fine.surface.num_triangles < 6 / (0.433 * 0.01) * 1.7);
        CHECK(meshed(&fine.surface, 0.1, &volume) == 1 && fabs(volume - 1) < 1e-12);
        mesher_fine_surface_free(&fine);
        CHECK(fine.xyz == NULL);
        shape_free(&s);
    }
}

/* Triangles that are there twice, in either orientation: their parts are, too, and lie on each
 * other, also where a budget ends it. */
static void test_copies(void)
{
    uint64_t most;
    for (most = 0; most < 400; most += most ? 37 : 40) {
        shape s = {0};
        mesher_fine_surface fine;
        mesher_options o = sized(0.1);
        mesher_surface given;
        mesher_report report;
        uint32_t i, t[3];
        memset(&report, 0, sizeof report);
        random_box(&s, 1, 1, 1, 1);
        for (i = 0; i < 12; i += 2) {
            memcpy(t, s.triangles + 3 * i, sizeof t);
            if (i % 4) add_triangle(&s, t[1], t[2], t[0]);
            else add_triangle(&s, t[2], t[1], t[0]);
        }
        given = surface_of(&s);
        o.max_tets = most;
        CHECK(mesher_refine_surface(&fine, &given, &o, NULL) ==
              (most ? MESHER_STOPPED_BY_BUDGET : MESHER_OK));
        CHECK(mesher_check(&fine.surface, NULL, &report) == MESHER_OK);
        CHECK(fabs(measure(&fine.surface).area - 9) < 1e-12);
        CHECK(report.counts[MESHER_NOTE_OPEN_EDGE] == 0);
        for (i = 0, t[0] = t[1] = 0; i < fine.surface.num_triangles; i++) {
            t[0] += fine.triangle_source[i] >= 12 && fine.triangle_source[i] % 2 == 0;
            t[1] += fine.triangle_source[i] >= 12 && fine.triangle_source[i] % 2 == 1;
        }
        CHECK(t[0] > 0 && report.counts[MESHER_NOTE_OPPOSITE_TRIANGLE] == t[0]);
        CHECK(t[1] > 0 && report.counts[MESHER_NOTE_DUPLICATE_TRIANGLE] == t[1]);
        mesher_fine_surface_free(&fine);
        shape_free(&s);
    }
}

/* The centre of a fan of needles needs few vertices around it. */
static void test_needles(void)
{
    enum { RIM = 256 };
    shape s = {0};
    mesher_fine_surface fine;
    mesher_options o = sized(0.2);
    mesher_surface given;
    measures m;
    uint32_t i, low, high, side;
    size_t v, near_centre = 0;
    double volume, before;
    for (side = 0; side < 2; side++)
        for (i = 0; i < RIM; i++)
            add_vertex(&s, cos(6.283185307179586 * i / RIM), sin(6.283185307179586 * i / RIM),
                       side);
    low = add_vertex(&s, 0, 0, 0);
    high = add_vertex(&s, 0, 0, 1);
    add_band(&s, 0, RIM, RIM, 0);
    for (i = 0; i < RIM; i++) {
        add_triangle(&s, low, (i + 1) % RIM, i);
        add_triangle(&s, high, RIM + i, RIM + (i + 1) % RIM);
    }
    given = surface_of(&s);
    before = measure(&given).volume;
    CHECK(mesher_refine_surface(&fine, &given, &o, NULL) == MESHER_OK);
    m = measure(&fine.surface);
    CHECK(is_closed(&fine.surface) && fabs(m.volume - before) < 1e-12);
    for (v = s.num_vertices; v < fine.surface.num_vertices; v++) {
        const double *x = fine.xyz + 3 * v;
        near_centre += x[0] * x[0] + x[1] * x[1] < 0.35;
        CHECK(x[2] == 0 || x[2] == 1); /* narrow facets of the side are left as they are */
    }
    CHECK(near_centre >= 20 && near_centre < 200);
    CHECK(meshed(&fine.surface, 0.2, &volume) == 1 && fabs(volume - before) < 1e-12);
    mesher_fine_surface_free(&fine);
    shape_free(&s);
}

/* Two boxes with a wall between them (rings of three triangles), tags that part a plane, and lines:
 * on an edge of it and inside. */
static void test_constraints(void)
{
    static const uint32_t quads[11][4] = {{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4}, {2, 3, 7, 6},
                                          {0, 4, 7, 3}, {1, 2, 6, 5}, {1, 8, 10, 5}, {2, 6, 11, 9},
                                          {1, 2, 9, 8}, {5, 10, 11, 6}, {8, 9, 11, 10}};
    shape s = {0};
    int32_t tags[22], edge_tags[2] = {7, 9};
    mesher_fine_surface fine;
    mesher_options o = sized(0.23);
    mesher_surface given;
    uint32_t i;
    size_t t, count[2] = {0, 0};
    double volume, along[2] = {0, 0}, tagged = 0;
    for (i = 0; i < 8; i++)
        add_vertex(&s, (i % 4 == 1) + (i % 4 == 2), i % 4 > 1, i / 4);
    for (i = 0; i < 4; i++) add_vertex(&s, 2, i % 2, i / 2);
    for (i = 0; i < 11; i++) {
        add_triangle(&s, quads[i][0], quads[i][1], quads[i][2]);
        add_triangle(&s, quads[i][0], quads[i][2], quads[i][3]);
        tags[2 * i] = tags[2 * i + 1] = (int32_t)i + 1;
    }
    tags[1] = 50;                              /* of the plane 0321, beyond a diagonal */
    add_edge(&s, 1, 2);                        /* of the wall */
    add_edge(&s, add_vertex(&s, 0.3, 0.3, 0.3), add_vertex(&s, 0.7, 0.6, 0.5));
    given = surface_of(&s);
    given.triangle_tags = tags;
    given.edge_tags = edge_tags;
    CHECK(mesher_refine_surface(&fine, &given, &o, NULL) == MESHER_OK);
    for (t = 0; t < fine.surface.num_triangles; t++) {
        uint32_t from = fine.triangle_source[t];
        CHECK(fine.triangle_tags[t] == tags[from]);
        if (fine.triangle_tags[t] == 50) tagged += area_of(&fine.surface, t);
    }
    CHECK(fabs(tagged - 0.5) < 1e-14);
    CHECK(fabs(measure(&fine.surface).area - 11) < 1e-12);
    for (t = 0; t < fine.surface.num_edges; t++) {
        uint32_t from = fine.edge_source[t];
        double l = length(fine.xyz + 3 * fine.edges[2 * t], fine.xyz + 3 * fine.edges[2 * t + 1]);
        CHECK(fine.edge_tags[t] == edge_tags[from] && l <= 0.23 * 1.4143);
        along[from] += l;
        count[from]++;
    }
    CHECK(fabs(along[0] - 1) < 1e-15 && count[0] == 4);
    CHECK(fabs(along[1] - sqrt(0.29)) < 1e-15 && count[1] == 2);
    CHECK(meshed(&fine.surface, 0.23, &volume) == 2 && fabs(volume - 2) < 1e-13);
    mesher_fine_surface_free(&fine);
    shape_free(&s);
}

/* Corners given once for each triangle, as in STL files, and some triangles that are none. */
static void test_soup(void)
{
    shape s = {0}, soup = {0};
    mesher_fine_surface fine;
    mesher_options o = sized(0.3);
    mesher_surface given;
    size_t i;
    random_box(&s, 1, 1, 1, 1);
    for (i = 0; i < 3 * s.num_triangles; i += 3) {
        const double *x = s.xyz + 3 * s.triangles[i], *y = s.xyz + 3 * s.triangles[i + 1];
        const double *z = s.xyz + 3 * s.triangles[i + 2];
        uint32_t a = add_vertex(&soup, x[0], x[1], x[2]), b = add_vertex(&soup, y[0], y[1], y[2]);
        add_triangle(&soup, a, b, add_vertex(&soup, z[0], z[1], z[2]));
        if (i == 6) add_triangle(&soup, a, a, b);
    }
    given = surface_of(&soup);
    CHECK(mesher_refine_surface(&fine, &given, &o, NULL) == MESHER_OK);
    CHECK(is_closed(&fine.surface) && fabs(measure(&fine.surface).volume - 1) < 1e-13);
    CHECK(memcmp(fine.xyz, soup.xyz, 3 * soup.num_vertices * sizeof *soup.xyz) == 0);
    mesher_fine_surface_free(&fine);
    shape_free(&s);
    shape_free(&soup);
}

static void wish_function(void *user, size_t count, const double *xyz, const uint32_t *region,
                          double *out)
{
    size_t i;
    (void)user;
    for (i = 0; i < count; i++) {
        CHECK(region[i] <= 1);
        out[i] = 0.04 + 0.3 * xyz[3 * i];
    }
}

/* Sizes from all places. */
static void test_sizes(void)
{
    shape s = {0};
    mesher_fine_surface fine;
    mesher_options o = sized(0);
    mesher_source ball;
    mesher_surface given;
    double own[8];
    size_t t, first;
    int k, kind;
    random_box(&s, 1, 1, 1, 1);
    given = surface_of(&s);
    memset(&ball, 0, sizeof ball);
    ball.xyz[0] = ball.xyz[1] = 0.5; /* the middle of a face */
    ball.radius = 0.05;
    ball.size = 0.03;
    for (t = 0; t < 8; t++) own[t] = 0.04 + 0.3 * s.xyz[3 * t];
    for (kind = 0; kind < 3; kind++) {
        size_t most = kind == 2 ? 600 : 4000;
        memset(&o, 0, sizeof o);
        if (kind == 0) o.size_function = wish_function;
        if (kind == 1) o.vertex_sizes = own;
        if (kind == 2) o.sources = &ball, o.num_sources = 1;
        CHECK(mesher_refine_surface(&fine, &given, &o, NULL) == MESHER_OK);
        CHECK(fine.surface.num_triangles > 200 && fine.surface.num_triangles < most);
        CHECK((fine.vertex_sizes != NULL) == (kind == 1));
        for (t = 0; t < fine.surface.num_triangles; t++)
            for (k = 0; k < 3; k++) {
                const double *a = corner(&fine.surface, t, k), *b = corner(&fine.surface, t, k + 1);
                double wish = 0.04 + 0.15 * (a[0] + b[0]);
                if (kind == 2)
                    wish = (mesher_source_size(&ball, 0, a) + mesher_source_size(&ball, 0, b)) / 2;
                CHECK(length(a, b) <= 1.415 * wish);
            }
        for (t = s.num_vertices; kind == 1 && t < fine.surface.num_vertices; t++)
            CHECK(fabs(fine.vertex_sizes[t] - 0.04 - 0.3 * fine.xyz[3 * t]) < 1e-14);
        mesher_fine_surface_free(&fine);
    }
    memset(&o, 0, sizeof o); /* no wish: nothing to divide */
    CHECK(mesher_refine_surface(&fine, &given, &o, NULL) == MESHER_OK);
    CHECK(fine.surface.num_vertices == 8 && fine.surface.num_triangles == 12);
    mesher_fine_surface_free(&fine);
    o.size = 0.05;
    o.min_size = 0.2;
    CHECK(mesher_refine_surface(&fine, &given, &o, NULL) == MESHER_OK);
    first = fine.surface.num_triangles;
    mesher_fine_surface_free(&fine);
    o = sized(0.2);
    CHECK(mesher_refine_surface(&fine, &given, &o, NULL) == MESHER_OK);
    CHECK(fine.surface.num_triangles == first);
    mesher_fine_surface_free(&fine);
    shape_free(&s);
}

static int stop_now(void *user, const char *phase, double fraction)
{
    (void)fraction;
    (void)phase;
    return --*(int *)user < 0;
}

/* Budgets, cancellation, what is no surface; each allocation fails once. */
static void test_failures(void)
{
    shape s = {0};
    mesher_fine_surface fine;
    mesher_options o = sized(0.05);
    mesher_surface given, bad;
    mesher_report report;
    mesher_result result = MESHER_ERROR_OUT_OF_MEMORY;
    int calls;
    long k;
    memset(&report, 0, sizeof report);
    random_box(&s, 1, 1, 1, 1);
    given = surface_of(&s);
    o.max_vertices = 100;
    CHECK(mesher_refine_surface(&fine, &given, &o, NULL) == MESHER_STOPPED_BY_BUDGET);
    CHECK(fine.surface.num_vertices == 50 && is_closed(&fine.surface));
    CHECK(fabs(measure(&fine.surface).volume - 1) < 1e-13);
    mesher_fine_surface_free(&fine);
    o = sized(1e-5);
    CHECK(mesher_refine_surface(&fine, &given, &o, &report) == MESHER_ERROR_TOO_LARGE);
    CHECK(strstr(report.message, "surface: the sizes ask for about") && fine.xyz == NULL);
    o.host.memory_limit_bytes = 4000000;
    CHECK(mesher_refine_surface(&fine, &given, &o, &report) == MESHER_STOPPED_BY_BUDGET);
    CHECK(strstr(report.message, "host.memory_limit_bytes") && is_closed(&fine.surface));
    CHECK(fine.surface.num_triangles > 1000);
    mesher_fine_surface_free(&fine);
    o.host.memory_limit_bytes = 1000000;
    CHECK(mesher_refine_surface(&fine, &given, &o, NULL) == MESHER_ERROR_OUT_OF_MEMORY);
    CHECK(fine.xyz == NULL && fine.surface.num_triangles == 0);
    o = sized(0.01);
    for (calls = 0; calls < 3; calls++) {
        int left = calls;
        o.host.progress = stop_now;
        o.host.user = &left;
        CHECK(mesher_refine_surface(&fine, &given, &o, NULL) == MESHER_CANCELLED);
    }
    bad = given;
    bad.num_triangles = 0;
    CHECK(mesher_refine_surface(&fine, &bad, NULL, &report) < 0);
    bad.num_vertices = 0;
    CHECK(mesher_refine_surface(&fine, &bad, NULL, &report) < 0);
    CHECK(mesher_refine_surface(&fine, NULL, NULL, NULL) == MESHER_ERROR_INVALID_ARGUMENT);
    s.xyz[4] = 1 / 0.0 * 0.0;
    CHECK(mesher_refine_surface(&fine, &given, NULL, &report) == MESHER_ERROR_SURFACE);
    CHECK(strstr(report.message, "vertex 1") != NULL);
    s.xyz[4] = 0;
    for (k = 0; result != MESHER_OK && k < 1000; k++) {
        small_allocator a = {0, 0};
        a.countdown = k;
        o = sized(0.1);
        o.host.allocator.alloc = small_alloc;
        o.host.allocator.release = small_release;
        o.host.allocator.user = &a;
        result = mesher_refine_surface(&fine, &given, &o, NULL);
        CHECK(result == MESHER_OK || (result == MESHER_ERROR_OUT_OF_MEMORY && !fine.xyz));
        mesher_fine_surface_free(&fine);
        CHECK(a.outstanding == 0);
    }
    CHECK(result == MESHER_OK && k > 10);
    shape_free(&s);
}

/* All that shapes.h has, scaled and turned: the same shape, and a mesh of it. */
static void test_shapes(void)
{
    int kind, turned;
    for (kind = 0; kind < 5; kind++)
        for (turned = 0; turned < 3; turned++) {
            shape s = {0};
            mesher_fine_surface fine, again;
            mesher_options o = sized(0);
            mesher_surface given;
            measures before, after;
            double volume, scale = turned == 2 ? 1e-3 : 1;
            state = 88172645463325252u + (uint64_t)kind;
            if (kind == 0) twisted_prism(&s, 7, 0.3, 2);
            if (kind == 1) split_box(&s, 2, 40);
            if (kind == 2) lobed_plate(&s, 60, 5, 2);
            if (kind == 3) torus(&s, 0, 0, 24, 12, 0.4);
            if (kind == 4) random_ball(&s, 8, 0.5);
            transform(&s, 0.6 * turned, scale, 0);
            given = surface_of(&s);
            before = measure(&given);
            o.size = before.longest / (kind == 2 ? 15 : 5);
            o.host.num_threads = 1;
            CHECK(mesher_refine_surface(&fine, &given, &o, NULL) == MESHER_OK);
            after = measure(&fine.surface);
            CHECK(is_closed(&fine.surface));
            CHECK(fabs(after.area - before.area) < 1e-6 * before.area);
            CHECK(fabs(after.volume - before.volume) < 1e-6 * fabs(before.volume));
            CHECK(fine.surface.num_triangles > 2 * s.num_triangles || kind == 4);
            CHECK(meshed(&fine.surface, o.size, &volume) == 1 &&
                  fabs(volume - fabs(after.volume)) < 1e-9 * volume);
            o.host.num_threads = 3;
            CHECK(mesher_refine_surface(&again, &given, &o, NULL) == MESHER_OK);
            CHECK(again.surface.num_triangles == fine.surface.num_triangles &&
                  memcmp(again.triangles, fine.triangles,
                         12 * fine.surface.num_triangles) == 0 &&
                  memcmp(again.xyz, fine.xyz, 24 * fine.surface.num_vertices) == 0);
            mesher_fine_surface_free(&fine);
            mesher_fine_surface_free(&again);
            shape_free(&s);
        }
}

/* A box with tiny spikes on its top, lower than what counts as a plane elsewhere: their sides are
 * not taken for a part of that, and do not fold. */
static void test_spikes(void)
{
    enum { SIDE = 6 };
    static const uint32_t around[5] = {0, 1, 3, 2, 0};
    int round;
    for (round = 0; round < 24; round++) {
        shape s = {0};
        mesher_fine_surface fine;
        mesher_options o = sized(0.1);
        mesher_surface given;
        double step = pow(10, -7 - round % 6);
        uint32_t i, j, rim[4 * SIDE + 1];
        for (i = 0; i < 8; i++)
            add_vertex(&s, i & 1 ? 0.5 : -0.5, i & 2 ? 0.5 : -0.5, i < 4 ? -1 : 0);
        for (i = 0; i <= SIDE; i++)
            for (j = 0; j <= SIDE; j++)
                add_vertex(&s, (j - SIDE / 2.0) * step, (i - SIDE / 2.0) * step,
                           i % SIDE && j % SIDE ? 6 * step * random_unit() : 0);
        for (i = 0; i < SIDE; i++) {
            rim[i] = 8 + i;
            rim[SIDE + i] = 8 + (SIDE + 1) * i + SIDE;
            rim[2 * SIDE + i] = 8 + (SIDE + 1) * SIDE + SIDE - i;
            rim[3 * SIDE + i] = 8 + (SIDE + 1) * (SIDE - i);
            for (j = 0; j < SIDE; j++) {
                uint32_t a = 8 + (SIDE + 1) * i + j, b = a + SIDE + 1;
                add_triangle(&s, a, a + 1, b + 1);
                add_triangle(&s, a, b + 1, b);
            }
        }
        rim[4 * SIDE] = rim[0];
        for (i = 0; i < 4; i++) {
            uint32_t a = around[i], b = around[i + 1];
            add_triangle(&s, a, b, 4 + b);
            add_triangle(&s, a, 4 + b, 4 + a);
            add_triangle(&s, 4 + a, 4 + b, rim[SIDE * i + SIDE]);
            for (j = 0; j < SIDE; j++)
                add_triangle(&s, 4 + a, rim[SIDE * i + j + 1], rim[SIDE * i + j]);
        }
        add_triangle(&s, 0, 2, 3);
        add_triangle(&s, 0, 3, 1);
        given = surface_of(&s);
        CHECK(is_closed(&given) && mesher_check(&given, NULL, NULL) == MESHER_OK);
        CHECK(mesher_refine_surface(&fine, &given, &o, NULL) == MESHER_OK);
        CHECK(is_closed(&fine.surface) && fine.surface.num_triangles > 1000);
        CHECK(mesher_check(&fine.surface, NULL, NULL) == MESHER_OK);
        mesher_fine_surface_free(&fine);
        shape_free(&s);
    }
}

/* Sizes that differ tenfold from one place to the next, as of noise. */
/* A vertex that nothing uses may be anywhere: what is flat is judged by the surface alone. */
static void test_far_vertices(void)
{
    shape s = {0};
    mesher_fine_surface fine;
    mesher_options o = sized(100);
    mesher_surface given;
    uint8_t *left_out;
    torus(&s, 0, 0, 140, 70, 0.3);
    add_vertex(&s, 1e8, 1e8, -1e8);
    given = surface_of(&s);
    left_out = (uint8_t *)calloc(s.num_vertices, 1);
    left_out[s.num_vertices - 1] = 1;
    given.left_out = left_out;
    CHECK(mesher_refine_surface(&fine, &given, &o, NULL) == MESHER_OK);
    CHECK(fine.surface.num_triangles == s.num_triangles);
    CHECK(!memcmp(fine.triangles, s.triangles, 3 * s.num_triangles * sizeof *s.triangles));
    mesher_fine_surface_free(&fine);
    free(left_out);
    shape_free(&s);
}

static void rough_wish(void *user, size_t count, const double *xyz, const uint32_t *region,
                       double *out)
{
    size_t i;
    (void)region;
    for (i = 0; i < count; i++) {
        double x = 1e6 * xyz[3 * i] + 3e6 * xyz[3 * i + 1] + 7e6 * xyz[3 * i + 2];
        uint64_t hash = ((uint64_t)floor(fabs(x)) + *(const uint32_t *)user) * 0x9e3779b97f4a7c15u;
        out[i] = hash >> 63 ? 0.3 : 0.03;
    }
}

/* Points do not come nearer and nearer to the edges of a box, over needles. */
static void test_rough_sizes(void)
{
    uint32_t seed;
    for (seed = 0; seed < 10; seed++) {
        shape s = {0};
        mesher_fine_surface fine;
        mesher_options o;
        mesher_surface given;
        measures m;
        memset(&o, 0, sizeof o);
        o.size_function = rough_wish;
        o.size_user = &seed;
        random_box(&s, 1, 1, 1, 1);
        given = surface_of(&s);
        CHECK(mesher_refine_surface(&fine, &given, &o, NULL) == MESHER_OK);
        m = measure(&fine.surface);
        CHECK(m.shortest > 0.002 && m.least_angle > 1 && is_closed(&fine.surface));
        CHECK(fabs(m.area - 6) < 1e-12 && fabs(m.volume - 1) < 1e-12);
        mesher_fine_surface_free(&fine);
        shape_free(&s);
    }
}

/* Bodies so flat that their two sides count as one plane: the edge that a flip would make may be
 * there already, on the other side. A sliver, and lenses of n triangles each above and below. */
static void test_flat_bodies(void)
{
    double xyz[3 * 42];
    uint32_t triangles[3 * 80], n, i;
    for (n = 0; n <= 40; n = n ? 2 * n : 5) {
        mesher_fine_surface fine;
        mesher_surface given;
        mesher_options o = sized(0.1);
        measures before, after;
        double volume;
        static const double sliver[12] = {-1, 0, 0, 1, 0, 0, 0, -0.5, 1e-5, 0, 0.5, 1e-5};
        static const uint32_t faces[12] = {0, 1, 2, 1, 0, 3, 2, 3, 0, 3, 2, 1};
        memset(&given, 0, sizeof given);
        memcpy(xyz, sliver, sizeof sliver);
        memcpy(triangles, faces, sizeof faces);
        for (i = 0; i < n; i++) {
            xyz[3 * i] = cos(6.2831853 * i / n);
            xyz[3 * i + 1] = sin(6.2831853 * i / n);
            xyz[3 * i + 2] = 0;
            triangles[6 * i] = triangles[6 * i + 4] = i;
            triangles[6 * i + 1] = triangles[6 * i + 3] = (i + 1) % n;
            triangles[6 * i + 2] = n;
            triangles[6 * i + 5] = n + 1;
        }
        if (n) {
            for (i = 0; i < 6; i++) xyz[3 * n + i] = 0;
            xyz[3 * n] = 0.9; /* the tips are not above each other */
            xyz[3 * n + 2] = 1e-6;
            xyz[3 * n + 5] = -1e-6;
        }
        given.xyz = xyz;
        given.num_vertices = n ? n + 2 : 4;
        given.triangles = triangles;
        given.num_triangles = n ? 2 * n : 4;
        before = measure(&given);
        CHECK(mesher_refine_surface(&fine, &given, &o, NULL) == MESHER_OK);
        after = measure(&fine.surface);
        CHECK(is_closed(&fine.surface) && fine.surface.num_triangles > 50);
        CHECK(fabs(after.area - before.area) < 1e-6 * before.area);
        CHECK(fabs(after.volume - before.volume) < 1e-5 * before.area);
        o.no_refine = 1;
        CHECK(meshed(&fine.surface, 0, &volume) == 1);
        mesher_fine_surface_free(&fine);
    }
}

/* The angle at the corner of triangle t opposite its edge ab, in degrees; -1 if it has no such
 * edge in this direction. */
static double angle_opposite(const mesher_surface *s, size_t t, uint32_t a, uint32_t b)
{
    const uint32_t *v = s->triangles + 3 * t;
    int k, c;
    for (k = 0; k < 3; k++) {
        const double *p = corner(s, t, k), *q = corner(s, t, k + 1), *r = corner(s, t, k + 2);
        double dot = 0;
        if (v[k] != a || v[(k + 1) % 3] != b) continue;
        for (c = 0; c < 3; c++) dot += (p[c] - r[c]) * (q[c] - r[c]);
        return atan2(2 * area_of(s, t), dot) * 57.29577951308232;
    }
    return -1;
}

/* The largest sum of the angles opposite an edge of two triangles with the same tag. */
static double largest_sum(const mesher_surface *s)
{
    double most = 0;
    size_t t, u;
    int k;
    for (t = 0; t < s->num_triangles; t++)
        for (u = 0; u < s->num_triangles; u++)
            for (k = 0; k < 3 && s->triangle_tags[t] == s->triangle_tags[u]; k++) {
                uint32_t a = s->triangles[3 * t + (size_t)k];
                uint32_t b = s->triangles[3 * t + (size_t)(k + 1) % 3];
                double other = angle_opposite(s, u, b, a);
                if (other >= 0) most = fmax(most, angle_opposite(s, t, a, b) + other);
            }
    return most;
}

static uint64_t num_flippable(const mesher_surface *s)
{
    mesher_domain domain;
    uint64_t count = 0;
    CHECK(mesher_domain_init(&domain, s, NULL, NULL) == MESHER_OK);
    CHECK(mesher_count_flips(&domain, &count) == MESHER_OK);
    mesher_domain_free(&domain);
    return count;
}

enum { RIM = 40 }; /* vertices of the bottom and of the top of a prism */

/* A prism over a flattened circle, bottom and top fanned from one vertex. Tags: 1 and 2 the two
 * halves of the bottom, 3 the top, 4 and more a side each. */
static void make_prism(double *xyz, uint32_t *triangles, int32_t *tags)
{
    uint32_t i, n = 0;
    for (i = 0; i < 2 * RIM; i++) {
        xyz[3 * i] = cos(6.2831853 * (i % RIM) / RIM);
        xyz[3 * i + 1] = 0.3 * sin(6.2831853 * (i % RIM) / RIM);
        xyz[3 * i + 2] = i < RIM ? 0 : 0.3;
    }
    for (i = 1; i + 1 < RIM; i++, n += 2) {
        uint32_t fans[6] = {0, 0, 0, RIM, 0, 0};
        fans[1] = i + 1, fans[2] = i, fans[4] = RIM + i, fans[5] = RIM + i + 1;
        memcpy(triangles + 3 * n, fans, sizeof fans);
        tags[n] = 1 + (i >= RIM / 2);
        tags[n + 1] = 3;
    }
    for (i = 0; i < RIM; i++, n += 2) {
        uint32_t j = (i + 1) % RIM, side[6];
        side[0] = side[3] = i, side[1] = j, side[2] = side[4] = RIM + j, side[5] = RIM + i;
        memcpy(triangles + 3 * n, side, sizeof side);
        tags[n] = tags[n + 1] = 4 + (int32_t)i;
    }
}

/* Flips alone: fans become Delaunay; vertices, borders of tags and a line across the top stay. */
static void test_flips(void)
{
    enum { TRIANGLES = 4 * RIM - 4 };
    double xyz[6 * RIM], volume;
    uint32_t triangles[3 * TRIANGLES], line[2] = {RIM, RIM + 14}, i;
    int32_t tags[TRIANGLES];
    mesher_domain none;
    uint64_t count;
    int turned;
    for (turned = 0; turned < 3; turned++) {
        mesher_fine_surface fine, again;
        mesher_surface given;
        mesher_options o = sized(0.01); /* has no effect */
        measures before, after;
        size_t k, num[3] = {0, 0, 0}, has_line = 0;
        make_prism(xyz, triangles, tags);
        for (i = 0; i < 2 * RIM && turned; i++) { /* rounding bends the planes */
            double *p = xyz + 3 * i, x = p[0], y = p[1], z = p[2];
            p[0] = 0.6 * x - 0.8 * y + turned;
            p[1] = 0.28 * (0.8 * x + 0.6 * y) - 0.96 * z;
            p[2] = 0.96 * (0.8 * x + 0.6 * y) + 0.28 * z;
        }
        memset(&given, 0, sizeof given);
        given.xyz = xyz;
        given.num_vertices = 2 * RIM;
        given.triangles = triangles;
        given.triangle_tags = tags;
        given.num_triangles = TRIANGLES;
        given.edges = turned == 2 ? line : NULL;
        given.num_edges = turned == 2;
        before = measure(&given);
        CHECK(largest_sum(&given) > 185);
        CHECK(num_flippable(&given) > 20);
        CHECK(mesher_flip_surface(&fine, &given, &o, NULL) == MESHER_OK);
        after = measure(&fine.surface);
        CHECK(fine.num_flips > 60 && fine.surface.num_vertices == 2 * RIM);
        CHECK(memcmp(fine.xyz, xyz, sizeof xyz) == 0 && fine.vertex_sizes == NULL);
        CHECK(fine.surface.num_triangles == TRIANGLES && is_closed(&fine.surface));
        CHECK(fabs(after.area - before.area) < 1e-12 && fabs(after.volume - before.volume) < 1e-12);
        CHECK(after.least_angle > before.least_angle);
        if (turned < 2) CHECK(largest_sum(&fine.surface) < 180 + 1e-6);
        for (k = 0; k < TRIANGLES; k++) {
            if (fine.triangle_tags[k] <= 3) num[fine.triangle_tags[k] - 1]++;
            CHECK(fine.triangle_tags[k] == tags[fine.triangle_source[k]]);
            has_line += angle_opposite(&fine.surface, k, line[0], line[1]) >= 0;
        }
        CHECK(num[0] == RIM / 2 - 1 && num[1] == RIM / 2 - 1 && num[2] == RIM - 2);
        CHECK(has_line == (turned == 2) && fine.surface.num_edges == (turned == 2));
        CHECK(meshed(&fine.surface, 0, &volume) == 1 && fabs(volume - before.volume) < 1e-12);
        CHECK(mesher_flip_surface(&again, &fine.surface, NULL, NULL) == MESHER_OK);
        CHECK(again.num_flips == 0); /* nothing is left to flip */
        CHECK(num_flippable(&fine.surface) == 0);
        CHECK(memcmp(again.triangles, fine.triangles, sizeof triangles) == 0);
        mesher_fine_surface_free(&again);
        mesher_fine_surface_free(&fine);
        given.num_triangles--; /* open: refused, with the caller's numbers */
        CHECK(mesher_flip_surface(&fine, &given, NULL, NULL) == MESHER_ERROR_SURFACE);
        CHECK(fine.xyz == NULL);
    }
    CHECK(mesher_flip_surface(NULL, NULL, NULL, NULL) == MESHER_ERROR_INVALID_ARGUMENT);
    memset(&none, 0, sizeof none);
    CHECK(mesher_count_flips(&none, &count) == MESHER_ERROR_INVALID_ARGUMENT);
}

int main(void)
{
    test_box();
    test_rough_sizes();
    test_copies();
    test_needles();
    test_constraints();
    test_soup();
    test_sizes();
    test_failures();
    test_shapes();
    test_spikes();
    test_far_vertices();
    test_flat_bodies();
    test_flips();
    return check_report();
}
