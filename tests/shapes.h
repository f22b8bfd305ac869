/* shapes.h - surfaces for tests, built triangle by triangle; the random ones depend on one seed,
 * `state`. After mesher.h. */
#ifndef SHAPES_H
#define SHAPES_H
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* -- a surface under construction */

typedef struct shape {
    double *xyz;
    uint32_t *triangles, *edges;
    size_t num_vertices, num_triangles, num_edges;
} shape;

DELAUNAY_INLINE uint32_t add_vertex(shape *s, double x, double y, double z)
{
    s->xyz = (double *)realloc(s->xyz, (s->num_vertices + 1) * 3 * sizeof *s->xyz);
    s->xyz[3 * s->num_vertices] = x;
    s->xyz[3 * s->num_vertices + 1] = y;
    s->xyz[3 * s->num_vertices + 2] = z;
    return (uint32_t)s->num_vertices++;
}

DELAUNAY_INLINE void add_triangle(shape *s, uint32_t a, uint32_t b, uint32_t c)
{
    uint32_t *t;
    s->triangles =
        (uint32_t *)realloc(s->triangles, (s->num_triangles + 1) * 3 * sizeof *s->triangles);
    t = s->triangles + 3 * s->num_triangles++;
    t[0] = a;
    t[1] = b;
    t[2] = c;
}

DELAUNAY_INLINE void add_edge(shape *s, uint32_t a, uint32_t b)
{
    s->edges = (uint32_t *)realloc(s->edges, (s->num_edges + 1) * 2 * sizeof *s->edges);
    s->edges[2 * s->num_edges] = a;
    s->edges[2 * s->num_edges++ + 1] = b;
}

DELAUNAY_INLINE mesher_surface surface_of(const shape *s)
{
    mesher_surface surface;
    memset(&surface, 0, sizeof surface);
    surface.xyz = s->xyz;
    surface.num_vertices = s->num_vertices;
    surface.triangles = s->triangles;
    surface.num_triangles = s->num_triangles;
    surface.edges = s->edges;
    surface.num_edges = s->num_edges;
    return surface;
}

DELAUNAY_INLINE void shape_free(shape *s)
{
    free(s->xyz);
    free(s->triangles);
    free(s->edges);
    memset(s, 0, sizeof *s);
}

static uint64_t state = 88172645463325252u;
DELAUNAY_INLINE uint32_t random_below(uint32_t n)
{
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return (uint32_t)(state >> 33) % n;
}
DELAUNAY_INLINE double random_unit(void) { return random_below(1u << 30) / (double)(1u << 30); }

/* x -> scale * R x + (shift, shift, -shift), where R rotates by `angle` about z, then by
 * 0.7 * angle about x. */
DELAUNAY_INLINE void transform(shape *s, double angle, double scale, double shift)
{
    size_t i;
    double c = cos(angle), d = sin(angle), e = cos(0.7 * angle), f = sin(0.7 * angle);
    for (i = 0; i < s->num_vertices; i++) {
        double *x = s->xyz + 3 * i, y[3];
        y[0] = c * x[0] - d * x[1];
        y[1] = e * (d * x[0] + c * x[1]) - f * x[2];
        y[2] = f * (d * x[0] + c * x[1]) + e * x[2];
        if (angle == 0) memcpy(y, x, sizeof y);
        x[0] = scale * y[0] + shift;
        x[1] = scale * y[1] + shift;
        x[2] = scale * y[2] - shift;
    }
}

/* A closed strip between two rings of n vertices; a bit chooses the diagonal of each quadrangle. */
DELAUNAY_INLINE void add_band(shape *s, uint32_t low, uint32_t high, uint32_t n, uint64_t bits)
{
    uint32_t i;
    for (i = 0; i < n; i++) {
        uint32_t a = low + i, b = low + (i + 1) % n, c = high + i, d = high + (i + 1) % n;
        if (bits >> (i % 64) & 1) {
            add_triangle(s, a, b, d);
            add_triangle(s, a, d, c);
        } else {
            add_triangle(s, a, b, c);
            add_triangle(s, b, d, c);
        }
    }
}

DELAUNAY_INLINE void add_fan(shape *s, uint32_t ring, uint32_t n, int up)
{
    uint32_t i;
    for (i = 1; i + 1 < n; i++) {
        if (up) add_triangle(s, ring, ring + i, ring + i + 1);
        else add_triangle(s, ring, ring + i + 1, ring + i);
    }
}

/* A stack of `levels` twisted prisms over an n-gon. The diagonals of their sides are reflex edges.
 * With n = 3 each one is Schonhardt's polyhedron. */
DELAUNAY_INLINE void twisted_prism(shape *s, uint32_t n, double twist, int levels)
{
    uint32_t first = (uint32_t)s->num_vertices, i;
    int l;
    for (l = 0; l <= levels; l++)
        for (i = 0; i < n; i++) {
            double t = 6.283185307179586 * i / n + l * twist;
            add_vertex(s, cos(t), sin(t), 1.2 * l);
        }
    for (l = 0; l < levels; l++)
        add_band(s, first + n * (uint32_t)l, first + n * (uint32_t)(l + 1), n, 0);
    add_fan(s, first, n, 0);
    add_fan(s, first + n * (uint32_t)levels, n, 1);
}

/* The saddle z = xy / n, which chazelle() is built around. */
DELAUNAY_INLINE double saddle(double x, double y, int n) { return x * y / n; }
DELAUNAY_INLINE void chazelle(shape *s, int n, double gap)
{
    /* A coarse relative of Chazelle's polyhedron, of 2 (n - 1) wedges. The sharp edges of those
     * from above run along y, at saddle + gap; of those from below, along x, at saddle - gap. */
    int i, side;
    double top = n + 2.0, w = 0.25;
    for (side = 0; side < 2; side++)
        for (i = 1; i < n; i++) {
            double p = i, q = side ? -1.0 : 1.0;
            uint32_t v[6];
            double z0 = saddle(p, 0, n) + q * gap, z1 = saddle(p, n, n) + q * gap;
            /* a thin wedge, a closed body of its own; its sharp edge is from v[0] to v[1] */
            if (side == 0) {
                v[0] = add_vertex(s, p, 0, z0);
                v[1] = add_vertex(s, p, n, z1);
                v[2] = add_vertex(s, p - w, 0, top);
                v[3] = add_vertex(s, p - w, n, top);
                v[4] = add_vertex(s, p + w, 0, top);
                v[5] = add_vertex(s, p + w, n, top);
            } else {
                v[0] = add_vertex(s, 0, p, z0);
                v[1] = add_vertex(s, n, p, z1);
                v[2] = add_vertex(s, 0, p - w, -top);
                v[3] = add_vertex(s, n, p - w, -top);
                v[4] = add_vertex(s, 0, p + w, -top);
                v[5] = add_vertex(s, n, p + w, -top);
            }
            add_triangle(s, v[0], v[2], v[4]);
            add_triangle(s, v[1], v[5], v[3]);
            add_triangle(s, v[0], v[1], v[2]);
            add_triangle(s, v[1], v[3], v[2]);
            add_triangle(s, v[0], v[4], v[1]);
            add_triangle(s, v[1], v[4], v[5]);
            add_triangle(s, v[2], v[3], v[4]);
            add_triangle(s, v[3], v[5], v[4]);
        }
}

/* The surface of a box of nx * ny * nz cells, each of its squares cut along a random diagonal: with
 * coplanar and cospherical vertices everywhere. */
DELAUNAY_INLINE void random_box(shape *s, int nx, int ny, int nz, double thickness)
{
    int n[3], axis, side, i, j, k;
    uint32_t base = (uint32_t)s->num_vertices, *id;
    n[0] = nx;
    n[1] = ny;
    n[2] = nz;
    id = (uint32_t *)malloc(sizeof *id * (size_t)((nx + 1) * (ny + 1) * (nz + 1)));
    (void)base;
    for (k = 0; k <= nz; k++)
        for (j = 0; j <= ny; j++)
            for (i = 0; i <= nx; i++)
                if (i == 0 || j == 0 || k == 0 || i == nx || j == ny || k == nz)
                    id[(k * (ny + 1) + j) * (nx + 1) + i] = add_vertex(s, i, j, k * thickness);
    for (axis = 0; axis < 3; axis++)
        for (side = 0; side < 2; side++) {
            int u = (axis + 1) % 3, v = (axis + 2) % 3, p, q;
            for (p = 0; p < n[u]; p++)
                for (q = 0; q < n[v]; q++) {
                    uint32_t c[4];
                    int m;
                    for (m = 0; m < 4; m++) {
                        int x[3];
                        x[axis] = side * n[axis];
                        x[u] = p + (m == 1 || m == 2);
                        x[v] = q + (m >= 2);
                        c[m] = id[(x[2] * (ny + 1) + x[1]) * (nx + 1) + x[0]];
                    }
                    if (!side) {
                        uint32_t t = c[1];
                        c[1] = c[3];
                        c[3] = t;
                    }
                    if (random_below(2)) {
                        add_triangle(s, c[0], c[1], c[2]);
                        add_triangle(s, c[0], c[2], c[3]);
                    } else {
                        add_triangle(s, c[1], c[2], c[3]);
                        add_triangle(s, c[1], c[3], c[0]);
                    }
                }
        }
    free(id);
}

/* A box whose triangles are split in three at random points inside them, again and again: needles
 * that lie in one plane until the box is rotated. */
DELAUNAY_INLINE void split_box(shape *s, int n, int splits)
{
    int i, k;
    random_box(s, n, n, n, 1);
    for (i = 0; i < splits; i++) {
        size_t t = random_below((uint32_t)s->num_triangles);
        double x[3], u = 0.1 + 0.8 * random_unit(), v = (1 - u) * (0.1 + 0.8 * random_unit());
        uint32_t *f = s->triangles + 3 * t, a = f[0], b = f[1], c = f[2], d;
        for (k = 0; k < 3; k++) {
            const double *p = s->xyz + 3 * (size_t)a + k, *q = s->xyz + 3 * (size_t)b + k;
            x[k] = *p + u * (*q - *p) + v * (s->xyz[3 * (size_t)c + (size_t)k] - *p);
        }
        d = add_vertex(s, x[0], x[1], x[2]);
        f[2] = d;
        add_triangle(s, b, c, d);
        add_triangle(s, c, a, d);
    }
}

/* Twice the signed area of a triangle, seen from above. */
DELAUNAY_INLINE double area_above(const shape *s, uint32_t a, uint32_t b, uint32_t c)
{
    const double *x = s->xyz + 3 * a, *y = s->xyz + 3 * b, *z = s->xyz + 3 * c;
    return (y[0] - x[0]) * (z[1] - x[1]) - (y[1] - x[1]) * (z[0] - x[0]);
}

/* Is abc an ear of a polygon of n vertices, seen from above? */
DELAUNAY_INLINE int is_ear(const shape *s, const uint32_t *polygon, uint32_t n, uint32_t a,
                           uint32_t b, uint32_t c)
{
    uint32_t i;
    if (area_above(s, a, b, c) <= 1e-9) return 0;
    for (i = 0; i < n; i++) {
        uint32_t v = polygon[i];
        if (v != a && v != b && v != c && area_above(s, a, b, v) >= 0 &&
            area_above(s, b, c, v) >= 0 && area_above(s, c, a, v) >= 0)
            return 0;
    }
    return 1;
}

/* A plate with lobes and n corners. Its two sides are cut into needles: ears are clipped one after
 * the other, each next to the last one. */
DELAUNAY_INLINE void lobed_plate(shape *s, uint32_t n, int lobes, double thickness)
{
    uint32_t *left = (uint32_t *)malloc(n * sizeof *left), m = n, i, vain = 0;
    size_t t, sides;
    for (i = 0; i < 2 * n; i++) {
        double angle = 6.283185307179586 * (i % n) / n, radius = 15 + 4 * sin(lobes * angle);
        add_vertex(s, radius * cos(angle), radius * sin(angle), i < n ? 0 : thickness);
    }
    for (i = 0; i < n; i++) left[i] = i;
    for (i = 0; m > 2 && vain < m; vain++, i = (i + 1) % m) {
        uint32_t a = left[(i + m - 1) % m], b = left[i], c = left[(i + 1) % m];
        if (m > 3 && !is_ear(s, left, m, a, b, c)) continue;
        add_triangle(s, a, c, b);
        memmove(left + i, left + i + 1, (m - i - 1) * sizeof *left);
        m--;
        i = (i + 2 * m - 2) % m;
        vain = 0;
    }
    for (t = 0, sides = s->num_triangles; t < sides; t++)
        add_triangle(s, s->triangles[3 * t] + n, s->triangles[3 * t + 2] + n,
                     s->triangles[3 * t + 1] + n);
    for (i = 0; i < n; i++) {
        add_triangle(s, i, (i + 1) % n, (i + 1) % n + n);
        add_triangle(s, i, (i + 1) % n + n, i + n);
    }
    free(left);
}

/* A torus with its centre at (x, 0, 0) in the xy plane, or upright, in the xz plane. */
DELAUNAY_INLINE void torus(shape *s, double x, int upright, uint32_t n, uint32_t m, double thick)
{
    uint32_t base = (uint32_t)s->num_vertices, i, j;
    for (i = 0; i < n; i++)
        for (j = 0; j < m; j++) {
            double a = 6.283185307179586 * i / n, b = 6.283185307179586 * (j + 0.5 * (i % 2)) / m;
            double r = 1 + thick * cos(b), h = thick * sin(b);
            if (upright) add_vertex(s, x + r * cos(a), h, r * sin(a));
            else add_vertex(s, x + r * cos(a), r * sin(a), h);
        }
    for (i = 0; i < n; i++)
        for (j = 0; j < m; j++) {
            uint32_t a = base + i * m + j, b = base + (i + 1) % n * m + j;
            uint32_t c = base + i * m + (j + 1) % m, d = base + (i + 1) % n * m + (j + 1) % m;
            add_triangle(s, a, b, c);
            add_triangle(s, b, d, c);
        }
}

/* A sphere of n - 1 rings of 2n vertices, each rotated against the one before, and two poles. */
DELAUNAY_INLINE void sphere(shape *s, double x, double radius, uint32_t n)
{
    uint32_t base = (uint32_t)s->num_vertices, i, j, top, bottom;
    for (i = 1; i < n; i++)
        for (j = 0; j < 2 * n; j++) {
            double a = 3.141592653589793 * i / n, b = 3.141592653589793 * (j + 0.37 * i) / n;
            add_vertex(s, x + radius * sin(a) * cos(b), radius * sin(a) * sin(b), radius * cos(a));
        }
    top = add_vertex(s, x, 0, radius);
    bottom = add_vertex(s, x, 0, -radius);
    for (i = 0; i + 2 < n; i++)
        add_band(s, base + (i + 1) * 2 * n, base + i * 2 * n, 2 * n, state >> 3);
    for (j = 0; j < 2 * n; j++) {
        add_triangle(s, top, base + j, base + (j + 1) % (2 * n));
        add_triangle(s, bottom, base + (n - 2) * 2 * n + (j + 1) % (2 * n),
                     base + (n - 2) * 2 * n + j);
    }
}

/* A star-shaped polyhedron: the triangulation of sphere(), with random radii. */
DELAUNAY_INLINE void random_ball(shape *s, uint32_t n, double roughness)
{
    size_t i, first = s->num_vertices;
    int k;
    sphere(s, 0, 1, n);
    for (i = first; i < s->num_vertices; i++) {
        double f = 1 + roughness * random_unit();
        for (k = 0; k < 3; k++) s->xyz[3 * i + (size_t)k] *= f;
    }
}

DELAUNAY_INLINE void tetrahedron(shape *s, double x, double y, double z, double size)
{
    uint32_t a = add_vertex(s, x, y, z), b = add_vertex(s, x + size, y, z);
    uint32_t c = add_vertex(s, x, y + size, z), d = add_vertex(s, x, y, z + size);
    add_triangle(s, a, c, b);
    add_triangle(s, a, b, d);
    add_triangle(s, b, c, d);
    add_triangle(s, a, d, c);
}

/* -- isosurfaces */

typedef struct iso {
    shape *s;
    uint32_t n, *vertex; /* 1 + vertex on each of the 7 edges of a node, 0: none */
    double speck;
} iso;

DELAUNAY_INLINE double iso_value(const iso *g, const uint32_t *at)
{
    double t[3], f = 0;
    int k;
    for (k = 0; k < 3; k++) {
        if (at[k] == 0 || at[k] == g->n - 1) return 0.5;
        t[k] = 6.283185307179586 * at[k] / (g->n - 1);
    }
    for (k = 0; k < 3; k++) f += sin(t[k]) * cos(t[(k + 1) % 3]);
    return fabs(f) < g->speck ? g->speck : f;
}

/* The vertex on the edge between two nodes; no coordinate of the second one is smaller. */
DELAUNAY_INLINE uint32_t iso_vertex(iso *g, const uint32_t *a, const uint32_t *b)
{
    double u = iso_value(g, a), v = iso_value(g, b), t = u / (u - v), x[3];
    uint32_t *place, way = 0, k;
    for (k = 0; k < 3; k++) {
        way |= (b[k] - a[k]) << k;
        x[k] = (a[k] + t * ((double)b[k] - a[k])) / (g->n - 1);
    }
    place = g->vertex + 7 * (a[0] + g->n * (a[1] + g->n * a[2])) + (way - 1);
    if (*place == 0) *place = 1 + add_vertex(g->s, x[0], x[1], x[2]);
    return *place - 1;
}

/* Adds the triangles of the isosurface in a tetrahedron of nodes, of which none has a smaller
 * coordinate than the one before. `odd`: the parity of the tetrahedron. */
DELAUNAY_INLINE void iso_tet(iso *g, uint32_t (*at)[3], int odd)
{
    uint32_t in[4], out[4], v[4], num_in = 0, num_out = 0, i, k;
    for (i = 0; i < 4; i++)
        if (iso_value(g, at[i]) < 0) in[num_in++] = i;
        else out[num_out++] = i;
    if (num_in == 0 || num_out == 0) return;
    for (i = 0; i < num_in; i++)
        for (k = i + 1; k < 4; k++) odd ^= k < num_in ? 0 : out[k - num_in] < in[i];
    if (num_in == 2) {
        static const int way[4][2] = {{0, 0}, {0, 1}, {1, 1}, {1, 0}};
        for (i = 0; i < 4; i++) {
            uint32_t a = in[way[i][0]], b = out[way[i][1]];
            v[i] = iso_vertex(g, at[a < b ? a : b], at[a < b ? b : a]);
        }
    } else {
        for (i = 0; i < 3; i++) {
            uint32_t a = num_in == 1 ? in[0] : in[i], b = num_in == 1 ? out[i] : out[0];
            v[i] = iso_vertex(g, at[a < b ? a : b], at[a < b ? b : a]);
        }
    }
    add_triangle(g->s, v[0], v[odd ? 2 : 1], v[odd ? 1 : 2]);
    if (num_in == 2) add_triangle(g->s, v[0], v[odd ? 3 : 2], v[odd ? 2 : 3]);
}

/* A gyroid in a cube, by marching tetrahedra on n nodes a side. Where the function is below `speck`
 * at a node, it is taken as `speck`: around this node are triangles of that size, and needles at
 * them. */
DELAUNAY_INLINE void gyroid(shape *s, uint32_t n, double speck)
{
    static const int order[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1},
                                    {0, 2, 1}, {2, 1, 0}, {1, 0, 2}};
    uint32_t at[4][3], c, cells = (n - 1) * (n - 1) * (n - 1), j, k;
    iso g;
    memset(&g, 0, sizeof g);
    g.s = s;
    g.n = n;
    g.speck = speck;
    g.vertex = (uint32_t *)calloc((size_t)7 * n * n * n, sizeof *g.vertex);
    for (c = 0; c < cells; c++)
        for (j = 0; j < 6; j++) {
            at[0][0] = c % (n - 1);
            at[0][1] = c / (n - 1) % (n - 1);
            at[0][2] = c / (n - 1) / (n - 1);
            for (k = 1; k < 4; k++) {
                memcpy(at[k], at[k - 1], sizeof *at);
                at[k][order[j][k - 1]]++;
            }
            iso_tet(&g, at, j >= 3);
        }
    free(g.vertex);
}

#endif
