/* demo_part.h - the surface of a pipe flange with a hub, a bore, six bolt holes and rounded edges
 *
 * Include after meshio.h, whose mesh it fills. Everything is a grid: bodies of revolution about z
 * for the bore, the hub and the rim; around each bolt hole strips that widen from its edge to the
 * borders of a sector of the flat annulus between fillet and rim. Points of two patches that meet
 * are computed by the same expression, so they are equal in all bits and become one vertex; the
 * surface is closed and manifold by construction, its genus is 7. Millimetres.
 */
#ifndef DEMO_PART_H
#define DEMO_PART_H

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { DEMO_PART_HOLES = 6 };

/* Tags of the faces. */
enum {
    DEMO_PART_BOTTOM = 1,
    DEMO_PART_BORE,
    DEMO_PART_HUB_TOP,
    DEMO_PART_HUB,
    DEMO_PART_PLATE,
    DEMO_PART_RIM,
    DEMO_PART_BOLT_HOLE /* and the five numbers after it */
};

/* The surface under construction: vertices found again by their exact coordinates. */
typedef struct demo_part {
    meshio_mesh *mesh;
    size_t cap_vertices, cap_triangles, cap_table;
    uint32_t *table; /* open addressing, UINT32_MAX: empty */
    int around;      /* points on a full turn */
    int failed;      /* out of memory */
} demo_part;

static const double demo_part_turn = 6.283185307179586476925;

static size_t demo_part_slot(const demo_part *part, const double xyz[3])
{
    uint64_t h = 1, bits;
    size_t slot;
    int k;
    for (k = 0; k < 3; k++) {
        memcpy(&bits, &xyz[k], 8);
        h = (h ^ bits) * UINT64_C(0x9E3779B97F4A7C15);
        h ^= h >> 31;
    }
    for (slot = (size_t)h & (part->cap_table - 1);; slot = (slot + 1) & (part->cap_table - 1)) {
        uint32_t v = part->table[slot];
        if (v == UINT32_MAX || memcmp(part->mesh->xyz + 3 * (size_t)v, xyz, 24) == 0) return slot;
    }
}

/* The vertex at (x, y, z), new if there is none. */
static uint32_t demo_part_vertex(demo_part *part, double x, double y, double z)
{
    double xyz[3];
    size_t slot;
    meshio_mesh *m = part->mesh;
    xyz[0] = x + 0.0; /* no negative zero */
    xyz[1] = y + 0.0;
    xyz[2] = z + 0.0;
    if (part->failed || m->num_vertices == part->cap_vertices) {
        part->failed = 1;
        return 0;
    }
    slot = demo_part_slot(part, xyz);
    if (part->table[slot] == UINT32_MAX) {
        memcpy(m->xyz + 3 * m->num_vertices, xyz, 24);
        part->table[slot] = (uint32_t)m->num_vertices++;
    }
    return part->table[slot];
}

static void demo_part_triangle(demo_part *part, uint32_t a, uint32_t b, uint32_t c, int tag)
{
    meshio_mesh *m = part->mesh;
    size_t t = m->num_triangles;
    if (part->failed || t == part->cap_triangles) {
        part->failed = 1;
        return;
    }
    m->triangles[3 * t] = a;
    m->triangles[3 * t + 1] = b;
    m->triangles[3 * t + 2] = c;
    m->triangle_tags[t] = tag;
    m->num_triangles++;
}

static double demo_part_distance2(const demo_part *part, uint32_t a, uint32_t b)
{
    const double *p = part->mesh->xyz + 3 * (size_t)a, *q = part->mesh->xyz + 3 * (size_t)b;
    return (p[0] - q[0]) * (p[0] - q[0]) + (p[1] - q[1]) * (p[1] - q[1]) +
           (p[2] - q[2]) * (p[2] - q[2]);
}

/* A convex quadrilateral, cut along its shorter diagonal. */
static void demo_part_quad(demo_part *part, uint32_t a, uint32_t b, uint32_t c, uint32_t d, int tag)
{
    if (demo_part_distance2(part, a, c) <= demo_part_distance2(part, b, d)) {
        demo_part_triangle(part, a, b, c, tag);
        demo_part_triangle(part, a, c, d, tag);
    } else {
        demo_part_triangle(part, a, b, d, tag);
        demo_part_triangle(part, b, c, d, tag);
    }
}

/* The point at radius r and step j of `around`. */
static uint32_t demo_part_polar(demo_part *part, double r, int j, double z)
{
    double angle = demo_part_turn * (j % part->around) / part->around;
    return demo_part_vertex(part, r * cos(angle), r * sin(angle), z);
}

/* Revolves a profile of n points (r, z), the material on its right. */
static void demo_part_revolve(demo_part *part, const double *profile, int n, int tag)
{
    int i, j;
    for (i = 0; i + 1 < n; i++)
        for (j = 0; j < part->around; j++) {
            const double *p = profile + 2 * i, *q = p + 2;
            demo_part_quad(part, demo_part_polar(part, p[0], j, p[1]),
                           demo_part_polar(part, q[0], j, q[1]),
                           demo_part_polar(part, q[0], j + 1, q[1]),
                           demo_part_polar(part, p[0], j + 1, p[1]), tag);
        }
}

/* Appends an arc about (r, z) from angle a to b (in turns) in the given number of steps; the first
 * and the last point are given exactly. Returns the new number of points. */
static int demo_part_arc(double *profile, int n, double r, double z, double radius, double a,
                         double b, int steps, const double *first, const double *last)
{
    int i;
    for (i = 0; i <= steps; i++, n++) {
        double angle = demo_part_turn * (a + (b - a) * i / steps);
        profile[2 * n] = i == 0 ? first[0] : i == steps ? last[0] : r + radius * cos(angle);
        profile[2 * n + 1] = i == 0 ? first[1] : i == steps ? last[1] : z + radius * sin(angle);
    }
    return n;
}

/* Appends points from the last one to (r, z), the last one itself left out. */
static int demo_part_line(double *profile, int n, double r, double z, int steps)
{
    double r0 = profile[2 * n - 2], z0 = profile[2 * n - 1];
    int i;
    for (i = 1; i <= steps; i++, n++) {
        profile[2 * n] = i == steps ? r : r0 + (r - r0) * i / steps;
        profile[2 * n + 1] = i == steps ? z : z0 + (z - z0) * i / steps;
    }
    return n;
}

/* Point k of the closed line around the sector of a bolt hole, counter-clockwise seen from above:
 * outer arc, one side inwards, inner arc, the other side outwards. */
static uint32_t demo_part_border(demo_part *part, int hole, int k, double inner, double outer,
                                 int side, double z)
{
    int arc = part->around / DEMO_PART_HOLES, start = hole * arc;
    k %= 2 * (arc + side);
    if (k < arc) return demo_part_polar(part, outer, start + k, z);
    k -= arc;
    if (k < side)
        return demo_part_polar(part, k ? inner + (outer - inner) * (side - k) / side : outer,
                               start + arc, z);
    k -= side;
    if (k < arc) return demo_part_polar(part, inner, start + arc - k, z);
    k -= arc;
    return demo_part_polar(part, k ? inner + (outer - inner) * k / side : inner, start, z);
}

/* The strips around a bolt hole in polar coordinates about its centre: point k of the hole's edge
 * lies at an even angle, point k of the border where it is, the layers between them in between. */
typedef struct demo_part_fan {
    double cx, cy, inner, outer;
    int hole, side, layers, count;
    double even;                  /* angle of point 0 of the hole's edge */
    double angle[1024], distant[1024]; /* of the border's points */
} demo_part_fan;

static void demo_part_fan_set(demo_part *part, demo_part_fan *fan, double pitch, double z)
{
    int arc = part->around / DEMO_PART_HOLES, k;
    double turn = demo_part_turn * (fan->hole * arc + arc / 2) / part->around, sum = 0;
    fan->cx = pitch * cos(turn);
    fan->cy = pitch * sin(turn);
    fan->count = 2 * (arc + fan->side);
    for (k = 0; k < fan->count; k++) {
        uint32_t v = demo_part_border(part, fan->hole, k, fan->inner, fan->outer, fan->side, z);
        const double *p = part->mesh->xyz + 3 * (size_t)v;
        double x = p[0] - fan->cx, y = p[1] - fan->cy, angle = atan2(y, x);
        while (k > 0 && angle < fan->angle[k - 1]) angle += demo_part_turn;
        fan->angle[k] = angle;
        fan->distant[k] = sqrt(x * x + y * y);
        sum += angle - demo_part_turn * k / fan->count;
    }
    fan->even = sum / fan->count;
}

/* Point k on the circle of radius r (layer 0), or of a layer between that and the border. */
static uint32_t demo_part_fan_point(demo_part *part, const demo_part_fan *fan, int k, int layer,
                                    double r, double z)
{
    double t = (double)layer / fan->layers, angle;
    k %= fan->count;
    if (layer == fan->layers)
        return demo_part_border(part, fan->hole, k, fan->inner, fan->outer, fan->side, z);
    angle = fan->even + demo_part_turn * k / fan->count;
    t = t * (0.55 + 0.45 * t); /* strips widen outwards */
    angle += t * (fan->angle[k] - angle);
    r += t * (fan->distant[k] - r);
    return demo_part_vertex(part, fan->cx + r * cos(angle), fan->cy + r * sin(angle), z);
}

/* A bolt hole: its wall, of profile (radius, z) from the top down, and the strips around it in the
 * two flat faces. */
static void demo_part_bolt_hole(demo_part *part, const demo_part_fan *fan, const double *profile,
                                int n)
{
    const double *low = profile + 2 * (n - 1);
    int k, i;
    for (k = 0; k < fan->count; k++) {
        for (i = 0; i + 1 < n; i++) {
            const double *p = profile + 2 * i, *q = p + 2;
            demo_part_quad(part, demo_part_fan_point(part, fan, k, 0, p[0], p[1]),
                           demo_part_fan_point(part, fan, k + 1, 0, p[0], p[1]),
                           demo_part_fan_point(part, fan, k + 1, 0, q[0], q[1]),
                           demo_part_fan_point(part, fan, k, 0, q[0], q[1]),
                           DEMO_PART_BOLT_HOLE + fan->hole);
        }
        for (i = 0; i < fan->layers; i++) {
            demo_part_quad(part, demo_part_fan_point(part, fan, k, i, profile[0], profile[1]),
                           demo_part_fan_point(part, fan, k, i + 1, profile[0], profile[1]),
                           demo_part_fan_point(part, fan, k + 1, i + 1, profile[0], profile[1]),
                           demo_part_fan_point(part, fan, k + 1, i, profile[0], profile[1]),
                           DEMO_PART_PLATE);
            demo_part_quad(part, demo_part_fan_point(part, fan, k, i, low[0], low[1]),
                           demo_part_fan_point(part, fan, k + 1, i, low[0], low[1]),
                           demo_part_fan_point(part, fan, k + 1, i + 1, low[0], low[1]),
                           demo_part_fan_point(part, fan, k, i + 1, low[0], low[1]),
                           DEMO_PART_BOTTOM);
        }
    }
}

/* All patches; `level` 1, 2, .. sets the fineness. */
static void demo_part_patches(demo_part *part, int level)
{
    const double bore = 20, hub = 32, height = 46, plate = 14, rim = 80, pitch = 58, bolt = 7;
    const double round = 2, fillet = 6;
    const double inner = hub + fillet,
                 outer = rim - round; /* of the flat face with the bolt holes */
    double p[1024], end[4];
    demo_part_fan fan;
    int n, s = level + 1, hole;
    /* bottom: the ring between the bore and the bolt holes' sectors */
    p[0] = inner, p[1] = 0;
    n = demo_part_line(p, 1, bore + round, 0, 4 * level);
    demo_part_revolve(part, p, n, DEMO_PART_BOTTOM);
    /* bore, with a rounded edge at both ends */
    end[0] = bore + round, end[1] = 0, end[2] = bore, end[3] = round;
    n = demo_part_arc(p, 0, bore + round, round, round, 0.75, 0.5, s, end, end + 2);
    n = demo_part_line(p, n, bore, height - round, 14 * level);
    end[0] = bore, end[1] = height - round, end[2] = bore + round, end[3] = height;
    n = demo_part_arc(p, n - 1, bore + round, height - round, round, 0.5, 0.25, s, end, end + 2);
    demo_part_revolve(part, p, n, DEMO_PART_BORE);
    /* top of the hub */
    p[0] = bore + round, p[1] = height;
    n = demo_part_line(p, 1, hub - round, height, 3 * level);
    demo_part_revolve(part, p, n, DEMO_PART_HUB_TOP);
    /* rounded edge, wall of the hub, fillet down to the plate */
    end[0] = hub - round, end[1] = height, end[2] = hub, end[3] = height - round;
    n = demo_part_arc(p, 0, hub - round, height - round, round, 0.25, 0, s, end, end + 2);
    n = demo_part_line(p, n, hub, plate + fillet, 8 * level);
    end[0] = hub, end[1] = plate + fillet, end[2] = inner, end[3] = plate;
    n = demo_part_arc(p, n - 1, hub + fillet, plate + fillet, fillet, 0.5, 0.75, 2 * s, end,
                      end + 2);
    demo_part_revolve(part, p, n, DEMO_PART_HUB);
    /* rim of the plate */
    end[0] = outer, end[1] = plate, end[2] = rim, end[3] = plate - round;
    n = demo_part_arc(p, 0, outer, plate - round, round, 0.25, 0, s, end, end + 2);
    n = demo_part_line(p, n, rim, round, 3 * level);
    end[0] = rim, end[1] = round, end[2] = outer, end[3] = 0;
    n = demo_part_arc(p, n - 1, outer, round, round, 0, -0.25, s, end, end + 2);
    demo_part_revolve(part, p, n, DEMO_PART_RIM);
    /* bolt holes, their edges rounded */
    end[0] = bolt + round, end[1] = plate, end[2] = bolt, end[3] = plate - round;
    n = demo_part_arc(p, 0, bolt + round, plate - round, round, 0.25, 0.5, s, end, end + 2);
    n = demo_part_line(p, n, bolt, round, 7 * level);
    end[0] = bolt, end[1] = round, end[2] = bolt + round, end[3] = 0;
    n = demo_part_arc(p, n - 1, bolt + round, round, round, 0.5, 0.75, s, end, end + 2);
    fan.inner = inner;
    fan.outer = outer;
    fan.side = 8 * level;
    fan.layers = 6 * level;
    for (hole = 0; hole < DEMO_PART_HOLES && !part->failed; hole++) {
        fan.hole = hole;
        demo_part_fan_set(part, &fan, pitch, plate);
        demo_part_bolt_hole(part, &fan, p, n);
    }
}

/* Fills a mesh (to be freed by meshio_free) with the part's surface. Level 1: about 22 000
 * triangles, four times as many for each doubling; 1 .. 12. Returns 0 when out of memory. */
static int demo_part_make(meshio_mesh *mesh, int level)
{
    demo_part part;
    memset(&part, 0, sizeof part);
    memset(mesh, 0, sizeof *mesh);
    if (level < 1) level = 1;
    if (level > 12) level = 12;
    part.mesh = mesh;
    part.around = 96 * level;
    part.cap_triangles = (size_t)40000 * (size_t)level * (size_t)level;
    part.cap_vertices = part.cap_triangles / 2;
    for (part.cap_table = 1024; part.cap_table < 2 * part.cap_vertices;) part.cap_table *= 2;
    mesh->xyz = (double *)malloc(3 * part.cap_vertices * sizeof(double));
    mesh->vertex_tags = (int32_t *)calloc(part.cap_vertices, sizeof(int32_t));
    mesh->triangles = (uint32_t *)malloc(3 * part.cap_triangles * sizeof(uint32_t));
    mesh->triangle_tags = (int32_t *)malloc(part.cap_triangles * sizeof(int32_t));
    part.table = (uint32_t *)malloc(part.cap_table * sizeof(uint32_t));
    part.failed = !mesh->xyz || !mesh->vertex_tags || !mesh->triangles || !mesh->triangle_tags ||
                  !part.table;
    if (!part.failed) {
        memset(part.table, 255, part.cap_table * sizeof(uint32_t));
        demo_part_patches(&part, level);
        strcpy(mesh->name, "flange");
    }
    free(part.table);
    if (part.failed) meshio_free(mesh);
    return !part.failed;
}

#endif /* DEMO_PART_H */
