/* test_hard.c - random surfaces that are hard to recover, each result proved
 *
 *     test_hard [FIRST LAST]      seeds FIRST .. LAST; by default 1 .. HARD_CASES (environment
 *                                 variable), or 1 .. 100 without this
 *
 * Families: prisms twisted near their limit (Schonhardt), Chazelle's polyhedron, needles, fans,
 * plates as thin as 1e-6, spheres that nearly touch, polyhedra of coplanar and cospherical
 * vertices, fibres through a box, lattices of cells, interlocked tori, boxes of needles, rough
 * balls that are stretched; some scaled by 1e-6 or 1e6, some shifted by 1e6. Besides, needles on
 * two hyperboloids, a packing of long rods, and one surface with each allocation failing in turn.
 */
#ifndef LINKED
#  define MESHER_IMPLEMENTATION
#endif
#include "mesher.h"
#include <stdlib.h>
#include <time.h>
#include "check.h"
#include "shapes.h"

/* -- exact signs, by numbers of a fixed point */

enum {
    LIMBS = 80
}; /* of 32 bits, the point after bit 1200; |x| < 2^420 for what goes in, and products of three fit
    */
typedef struct fixed {
    int sign;
    uint32_t limb[LIMBS];
} fixed;

/* x * 2^400; what is below one is lost, and none of ours is. */
static void fixed_from(fixed *f, double x)
{
    int e, i;
    uint64_t m;
    memset(f, 0, sizeof *f);
    f->sign = x < 0 ? -1 : x > 0;
    if (!f->sign) return;
    m = (uint64_t)ldexp(frexp(fabs(x), &e), 53);
    e += 400 - 53;
    for (i = 0; i < 53; i++)
        if (m >> i & 1) f->limb[(e + i) / 32] |= 1u << ((e + i) % 32);
}

static int fixed_compare(const fixed *a, const fixed *b)
{
    int i;
    for (i = LIMBS; i-- > 0;)
        if (a->limb[i] != b->limb[i]) return a->limb[i] < b->limb[i] ? -1 : 1;
    return 0;
}

/* a + sign * b */
static fixed fixed_add(const fixed *a, const fixed *b, int sign)
{
    fixed r, larger = *a, smaller = *b;
    int i, same = a->sign * b->sign * sign >= 0;
    int64_t carry = 0;
    larger.sign = a->sign;
    smaller.sign = b->sign * sign;
    if (fixed_compare(a, b) < 0) {
        r = larger;
        larger = smaller;
        smaller = r;
    }
    for (i = 0; i < LIMBS; i++) {
        carry += same ? (int64_t)larger.limb[i] + smaller.limb[i]
                      : (int64_t)larger.limb[i] - smaller.limb[i];
        r.limb[i] = (uint32_t)carry;
        carry >>= 32;
    }
    r.sign = 0;
    for (i = 0; i < LIMBS; i++)
        if (r.limb[i]) r.sign = larger.sign ? larger.sign : smaller.sign;
    return r;
}

static fixed fixed_multiply(const fixed *a, const fixed *b)
{
    fixed r;
    int i, j;
    memset(&r, 0, sizeof r);
    r.sign = a->sign * b->sign;
    for (i = 0; i < LIMBS; i++) {
        uint64_t carry = 0;
        if (!a->limb[i]) continue;
        for (j = 0; i + j < LIMBS; j++) {
            carry += r.limb[i + j] + (uint64_t)a->limb[i] * b->limb[j];
            r.limb[i + j] = (uint32_t)carry;
            carry >>= 32;
        }
    }
    return r;
}

static int exact_orientation(const double *const *p)
{
    fixed d[3][3], total, minor, x, y;
    int i, k;
    for (i = 0; i < 3; i++)
        for (k = 0; k < 3; k++) {
            fixed_from(&x, p[i + 1][k]);
            fixed_from(&y, p[0][k]);
            d[i][k] = fixed_add(&x, &y, -1);
        }
    memset(&total, 0, sizeof total);
    for (k = 0; k < 3; k++) {
        x = fixed_multiply(&d[1][(k + 1) % 3], &d[2][(k + 2) % 3]);
        y = fixed_multiply(&d[1][(k + 2) % 3], &d[2][(k + 1) % 3]);
        minor = fixed_add(&x, &y, -1);
        x = fixed_multiply(&d[0][k], &minor);
        total = fixed_add(&total, &x, 1);
    }
    return total.sign;
}

/* Sign of det(b-a, c-a, d-a): in long doubles where that is sure, else exactly. */
static int orientation(const double *a, const double *b, const double *c, const double *d)
{
    const double *p[4];
    long double u[3][3], det = 0, sum = 0;
    int i, k;
    p[0] = a;
    p[1] = b;
    p[2] = c;
    p[3] = d;
    for (i = 0; i < 3; i++)
        for (k = 0; k < 3; k++) u[i][k] = (long double)p[i + 1][k] - (long double)a[k];
    for (k = 0; k < 3; k++) {
        long double x = u[1][(k + 1) % 3] * u[2][(k + 2) % 3],
                    y = u[1][(k + 2) % 3] * u[2][(k + 1) % 3];
        det += u[0][k] * (x - y);
        sum += fabsl(u[0][k]) * (fabsl(x) + fabsl(y));
    }
    if (fabsl(det) > 1e-14L * sum) return det > 0 ? 1 : -1;
    return exact_orientation(p);
}

/* -- is it a mesh of that surface? */

typedef struct face {
    uint32_t v[3], tet; /* ascending; odd: the other orientation */
    int odd;
} face;

static int sort_face(uint32_t *v)
{
    int i, j, odd = 0;
    for (i = 0; i < 2; i++)
        for (j = 0; j < 2 - i; j++)
            if (v[j] > v[j + 1]) {
                uint32_t t = v[j];
                v[j] = v[j + 1];
                v[j + 1] = t;
                odd ^= 1;
            }
    return odd;
}

static int compare_faces(const void *a, const void *b)
{
    return memcmp(a, b, 3 * sizeof(uint32_t));
}

/* All faces of tetrahedra, equal ones side by side. */
static face *faces_of(const mesher_output *out)
{
    static const uint8_t order[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};
    face *faces = (face *)malloc(4 * (size_t)out->num_tets * sizeof *faces);
    uint64_t t;
    int i, k;
    for (t = 0; t < out->num_tets; t++)
        for (i = 0; i < 4; i++) {
            face *f = faces + 4 * t + i;
            for (k = 0; k < 3; k++) f->v[k] = out->tets[4 * t + order[i][k]];
            f->odd = sort_face(f->v);
            f->tet = (uint32_t)t;
        }
    qsort(faces, 4 * (size_t)out->num_tets, sizeof *faces, compare_faces);
    return faces;
}

static uint32_t root_of(uint32_t *parent, uint32_t i)
{
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
}

/* Counts cells: sets of tetrahedra that meet in faces that are no facets; and faces between
 * regions. NULL if each face has one or two tetrahedra, on two sides, and each cell is of one
 * region. */
static const char *count_cells(const mesher_output *out, const face *faces, uint64_t *cells,
                               face *walls, size_t *num_walls)
{
    uint32_t *parent = (uint32_t *)malloc(((size_t)out->num_tets + 1) * sizeof *parent);
    const char *wrong = NULL;
    uint64_t i, n = 4 * out->num_tets, largest = 0;
    *num_walls = 0;
    for (i = 0; i < out->num_tets; i++) parent[i] = (uint32_t)i;
    for (i = 0; i < n && !wrong; i++) {
        int pair = i + 1 < n && !compare_faces(faces + i, faces + i + 1);
        if (pair && i + 2 < n && !compare_faces(faces + i, faces + i + 2))
            wrong = "a face of three tetrahedra";
        if (pair && faces[i].odd == faces[i + 1].odd)
            wrong = "two tetrahedra on one side of a face";
        if (!pair || out->regions[faces[i].tet] != out->regions[faces[i + 1].tet])
            walls[(*num_walls)++] = faces[i];
        else parent[root_of(parent, faces[i].tet)] = root_of(parent, faces[i + 1].tet);
        i += (uint64_t)pair;
    }
    *cells = 0;
    for (i = 0; i < out->num_tets; i++) {
        *cells += root_of(parent, (uint32_t)i) == i;
        if (out->regions[i] > largest) largest = out->regions[i];
    }
    if (!wrong && largest != *cells) wrong = "a region is not one cell";
    free(parent);
    return wrong;
}

/* NULL, or what is wrong with it. */
static const char *offence(const shape *s, const mesher_output *out, uint64_t cells)
{
    const char *wrong = NULL;
    face *faces = faces_of(out), *walls = (face *)malloc(4 * (size_t)out->num_tets * sizeof *walls);
    face *facets = (face *)malloc(s->num_triangles * sizeof *facets);
    uint64_t t, found = 0;
    size_t num_walls = 0, i;
    if (out->num_vertices < s->num_vertices ||
        memcmp(out->xyz, s->xyz, 3 * s->num_vertices * sizeof *s->xyz))
        wrong = "vertices changed";
    for (t = 0; t < out->num_tets && !wrong; t++) {
        const uint32_t *v = out->tets + 4 * t;
        if (orientation(out->xyz + 3 * (size_t)v[0], out->xyz + 3 * (size_t)v[1],
                        out->xyz + 3 * (size_t)v[2], out->xyz + 3 * (size_t)v[3]) <= 0)
            wrong = "a tetrahedron is not positive";
    }
    if (!wrong) wrong = count_cells(out, faces, &found, walls, &num_walls);
    if (!wrong && found != cells) wrong = "the number of regions";
    for (i = 0; i < s->num_triangles; i++) {
        memcpy(facets[i].v, s->triangles + 3 * i, sizeof facets[i].v);
        sort_face(facets[i].v);
    }
    qsort(facets, s->num_triangles, sizeof *facets, compare_faces);
    if (!wrong && num_walls != s->num_triangles) wrong = "the number of facets";
    for (i = 0; i < s->num_triangles && !wrong; i++)
        if (compare_faces(facets + i, walls + i)) wrong = "the facets";
    free(faces);
    free(walls);
    free(facets);
    return wrong;
}

/* -- families; each returns the number of bounded cells */

static void add_quad(shape *s, uint32_t a, uint32_t b, uint32_t c, uint32_t d)
{
    if (random_below(2)) {
        add_triangle(s, a, b, c);
        add_triangle(s, a, c, d);
    } else {
        add_triangle(s, b, c, d);
        add_triangle(s, b, d, a);
    }
}

/* One side of Chazelle's polyhedron: n notches from height h to the saddle, along y or, below,
 * along x. corner: of the side, first and last along the row of notches, at both ends of them.
 * Tips: two ends of each notch. */
static void notched_side(shape *s, int n, double gap, double w, double h, int below,
                         uint32_t corner[2][2], uint32_t *tips)
{
    uint32_t *left = (uint32_t *)malloc(sizeof *left * (size_t)n * 4), *right = left + 2 * n;
    double length = n + 1.0;
    int i, e;
    for (i = 0; i < n; i++)
        for (e = 0; e < 2; e++) {
            double p = i + 1, q = e * length, z = p * q / n + gap;
            uint32_t *v = tips + 2 * i + e;
            if (below) {
                *v = add_vertex(s, q, p, p * q / n - gap);
                left[2 * i + e] = add_vertex(s, q, p - w, h);
                right[2 * i + e] = add_vertex(s, q, p + w, h);
            } else {
                *v = add_vertex(s, p, q, z);
                left[2 * i + e] = add_vertex(s, p - w, q, h);
                right[2 * i + e] = add_vertex(s, p + w, q, h);
            }
        }
    for (i = 0; i < n; i++) {
        add_quad(s, tips[2 * i], tips[2 * i + 1], left[2 * i + 1], left[2 * i]);
        add_quad(s, tips[2 * i], tips[2 * i + 1], right[2 * i + 1], right[2 * i]);
        if (i + 1 < n)
            add_quad(s, right[2 * i], right[2 * i + 1], left[2 * i + 3], left[2 * i + 2]);
        for (e = 0; i + 1 < n && e < 2; e++)
            add_quad(s, tips[2 * i + e], right[2 * i + e], left[2 * i + 2 + e],
                     tips[2 * i + 2 + e]);
    }
    add_quad(s, corner[0][0], corner[0][1], left[1], left[0]);
    add_quad(s, right[2 * n - 2], right[2 * n - 1], corner[1][1], corner[1][0]);
    for (e = 0; e < 2; e++) {
        add_triangle(s, corner[0][e], left[e], tips[e]);
        add_triangle(s, corner[1][e], right[2 * n - 2 + e], tips[2 * n - 2 + e]);
    }
    free(left);
}

/* Chazelle's polyhedron: a box with n notches from above, to just above the saddle z = xy/n, and n
 * from below, across them, to just below it. */
static uint64_t true_chazelle(shape *s, int n, double gap, double w)
{
    double length = n + 1.0, top = length * (1.5 + random_unit()) + gap,
           bottom = -length * (0.5 + random_unit()) - gap;
    uint32_t box[2][2][2], corner[2][2], *tips = (uint32_t *)malloc(sizeof *tips * (size_t)n * 4);
    int i, e;
    for (i = 0; i < 8; i++)
        box[i & 1][i >> 1 & 1][i >> 2] =
            add_vertex(s, (i & 1) * length, (i >> 1 & 1) * length, i >> 2 ? top : bottom);
    for (i = 0; i < 2; i++)
        for (e = 0; e < 2; e++) corner[i][e] = box[i][e][1];
    notched_side(s, n, gap, w, top, 0, corner, tips);
    for (e = 0; e < 2; e++) { /* the ends y = 0 and y = length, below the tips */
        for (i = 0; i + 1 < n; i++)
            add_triangle(s, box[0][e][0], tips[2 * i + e], tips[2 * i + 2 + e]);
        add_triangle(s, box[0][e][0], box[1][e][0], tips[2 * n - 2 + e]);
        add_triangle(s, box[0][e][0], box[0][e][1], tips[e]);
        add_triangle(s, box[1][e][0], box[1][e][1], tips[2 * n - 2 + e]);
    }
    for (i = 0; i < 2; i++)
        for (e = 0; e < 2; e++) corner[i][e] = box[e][i][0];
    notched_side(s, n, gap, w, bottom, 1, corner, tips);
    for (e = 0; e < 2; e++) { /* the ends x = 0 and x = length, above the tips */
        for (i = 0; i + 1 < n; i++)
            add_triangle(s, box[e][0][1], tips[2 * i + e], tips[2 * i + 2 + e]);
        add_triangle(s, box[e][0][1], box[e][1][1], tips[2 * n - 2 + e]);
        add_triangle(s, box[e][0][0], box[e][0][1], tips[e]);
        add_triangle(s, box[e][1][0], box[e][1][1], tips[2 * n - 2 + e]);
    }
    free(tips);
    return 1;
}

/* A sphere some of whose vertices are pulled far out: seen from the centre, it stays as it is. */
static uint64_t needles(shape *s)
{
    double longest = pow(10, 0.3 + 2.2 * random_unit());
    size_t i;
    int k;
    sphere(s, 0, 1, 4 + random_below(6));
    for (i = 0; i < s->num_vertices; i++) {
        double f = random_below(4) ? 1 : 1 + longest * random_unit();
        for (k = 0; k < 3; k++) s->xyz[3 * i + (size_t)k] *= f;
    }
    return 1;
}

/* Two flat cones over one ring, apexes very near or very far. */
static uint64_t fans(shape *s)
{
    uint32_t n = 3 + random_below(120), i, up, down;
    double height = pow(10, 4 * random_unit() - 3), lower = random_below(2) ? height : 0.1 * height,
           wave = random_below(2) ? 0 : 0.3;
    for (i = 0; i < n; i++) {
        double t = 6.283185307179586 * i / n, r = i % 2 ? 1 : 1 - wave * random_unit();
        add_vertex(s, r * cos(t), r * sin(t), 0);
    }
    up = add_vertex(s, 0.2 * random_unit(), 0.1, height);
    down = add_vertex(s, 0.2 * random_unit(), -0.1, -lower);
    for (i = 0; i < n; i++) {
        add_triangle(s, up, i, (i + 1) % n);
        add_triangle(s, down, (i + 1) % n, i);
    }
    return 1;
}

/* Parallel bumpy sheets with other diagonals, closed along the sides: flat where both are so. */
static uint64_t plates(shape *s)
{
    double thick = pow(10, -6 * random_unit()), bump = random_below(2) ? 0 : 0.2 * thick;
    size_t i, first = s->num_vertices;
    random_box(s, 2 + (int)random_below(9), 2 + (int)random_below(9), 1, thick);
    for (i = first; i < s->num_vertices; i++) s->xyz[3 * i + 2] += bump * random_unit();
    return 1;
}

static uint64_t near_spheres(shape *s)
{
    double gap = pow(10, -1 - 6 * random_unit());
    uint32_t n = 2 * (2 + random_below(4));
    uint64_t same = state;
    size_t i, first;
    sphere(s, 0, 1, n);
    if (random_below(2)) { /* side by side, vertex to vertex */
        double corner[2] = {-10, 10};
        first = s->num_vertices;
        sphere(s, 0, 1, n);
        for (i = 0; i < first; i++)
            if (s->xyz[3 * i] > corner[0]) corner[0] = s->xyz[3 * i];
        for (i = first; i < s->num_vertices; i++)
            if (s->xyz[3 * i] < corner[1]) corner[1] = s->xyz[3 * i];
        for (i = first; i < s->num_vertices; i++) s->xyz[3 * i] += corner[0] - corner[1] + gap;
        return 2;
    }
    state = same; /* one within the other, with the same diagonals */
    sphere(s, 0, 1 + gap, n);
    return 2;
}

/* Coplanar, cospherical: rings of a sphere with any diagonals, or a box of cells. */
static uint64_t cospherical(shape *s)
{
    if (random_below(2)) {
        random_box(s, 1 + (int)random_below(7), 1 + (int)random_below(7), 1 + (int)random_below(7),
                   random_below(2) ? 1 : random_unit() + 0.01);
    } else {
        uint32_t n = 3 + random_below(12), rings = 2 + random_below(8), i, j;
        for (j = 1; j <= rings; j++)
            for (i = 0; i < n; i++) {
                double t = 6.283185307179586 * i / n, a = 3.141592653589793 * j / (rings + 1);
                add_vertex(s, sin(a) * cos(t), sin(a) * sin(t), cos(a));
            }
        for (j = 0; j + 1 < rings; j++)
            for (i = 0; i < n; i++)
                add_quad(s, j * n + i, (j + 1) * n + i, (j + 1) * n + (i + 1) % n,
                         j * n + (i + 1) % n);
        add_fan(s, 0, n, 1);
        add_fan(s, (rings - 1) * n, n, 0);
    }
    return 1;
}

static void add_box(shape *s, const double *lo, const double *hi)
{
    uint32_t v[8];
    int i;
    for (i = 0; i < 8; i++)
        v[i] = add_vertex(s, i & 1 ? hi[0] : lo[0], i & 2 ? hi[1] : lo[1], i & 4 ? hi[2] : lo[2]);
    add_quad(s, v[0], v[2], v[3], v[1]);
    add_quad(s, v[4], v[5], v[7], v[6]);
    add_quad(s, v[0], v[1], v[5], v[4]);
    add_quad(s, v[2], v[6], v[7], v[3]);
    add_quad(s, v[0], v[4], v[6], v[2]);
    add_quad(s, v[1], v[3], v[7], v[5]);
}

/* Thin rods in two directions within a box, layer by layer, nearly as long as it. */
static uint64_t fibres(shape *s)
{
    int layers = 1 + (int)random_below(4), each = 1 + (int)random_below(5), l, i, k;
    double gap = pow(10, -1 - 3 * random_unit()), lo[3] = {0, 0, 0}, hi[3],
           thick = 0.05 + 0.9 * random_unit();
    hi[0] = hi[1] = each;
    hi[2] = layers;
    add_box(s, lo, hi);
    for (l = 0; l < layers; l++)
        for (i = 0; i < each; i++) {
            k = l % 2;
            lo[k] = gap;
            hi[k] = each - gap;
            lo[1 - k] = i + 0.5 - 0.5 * thick * (1 - gap);
            hi[1 - k] = i + 0.5 + 0.5 * thick * (1 - gap);
            lo[2] = l + 0.5 * gap;
            hi[2] = l + 1 - 0.5 * gap;
            add_box(s, lo, hi);
        }
    return 1 + (uint64_t)(layers * each);
}

/* Cells of a grid of one of few materials; facets between different ones. */
static uint64_t lattice(shape *s)
{
    enum { MOST = 7 };
    uint32_t n = 2 + random_below(4), materials = 2 + random_below(3), x, y, z, axis,
             parent[MOST * MOST * MOST], total;
    uint8_t what[MOST][MOST][MOST];
    uint64_t cells = 0;
    memset(what, 0, sizeof what);
    for (z = 1; z <= n; z++)
        for (y = 1; y <= n; y++)
            for (x = 1; x <= n; x++) what[z][y][x] = (uint8_t)random_below(materials);
    what[1][1][1] = 1;
    total = MOST * MOST * MOST;
    for (x = 0; x < total; x++) parent[x] = x;
    for (z = 0; z <= n + 1; z++)
        for (y = 0; y <= n + 1; y++)
            for (x = 0; x <= n + 1; x++)
                add_vertex(s, x, y, z * 0.75); /* of cell (x, y, z): its low corner */
    for (z = 0; z <= n + 1; z++)
        for (y = 0; y <= n + 1; y++)
            for (x = 0; x <= n + 1; x++)
                for (axis = 0; axis < 3; axis++) {
                    uint32_t a = (z * (n + 2) + y) * (n + 2) + x, step[3], i = (axis + 1) % 3,
                             j = (axis + 2) % 3;
                    uint32_t px = x - (axis == 0), py = y - (axis == 1), pz = z - (axis == 2);
                    if (px > n + 1 || py > n + 1 || pz > n + 1) continue;
                    step[0] = 1;
                    step[1] = n + 2;
                    step[2] = (n + 2) * (n + 2);
                    if (what[z][y][x] == what[pz][py][px])
                        parent[root_of(parent, (z * MOST + y) * MOST + x)] =
                            root_of(parent, (pz * MOST + py) * MOST + px);
                    else add_quad(s, a, a + step[i], a + step[i] + step[j], a + step[j]);
                }
    for (z = 0; z <= n + 1; z++)
        for (y = 0; y <= n + 1; y++)
            for (x = 0; x <= n + 1; x++) {
                uint32_t c = (z * MOST + y) * MOST + x;
                cells += root_of(parent, c) == c;
            }
    return cells - 1;
}

/* Draws a shape out along (1, 0.3, 0.1). */
static void stretch(shape *s, double factor)
{
    static const double along[3] = {1, 0.3, 0.1};
    size_t i;
    int k;
    for (i = 0; i < s->num_vertices; i++) {
        double *x = s->xyz + 3 * i, h = (factor - 1) * (x[0] + 0.3 * x[1] + 0.1 * x[2]) / 1.1;
        for (k = 0; k < 3; k++) x[k] += h * along[k];
    }
}

/* A surface by its seed; the number of its bounded cells. */
static uint64_t hard_case(shape *s, uint64_t seed)
{
    static const double scales[5] = {1, 1, 1e-6, 1e6, 1}, shifts[5] = {0, 0, 0, 0, 1e6};
    uint32_t kind = (uint32_t)(seed % 12), how, i;
    uint64_t cells = 1;
    state = seed * 0x9E3779B97F4A7C15u + 1;
    for (i = 0; i < 8; i++) random_below(2);
    switch (kind) {
    case 0:
        twisted_prism(s, 3 + random_below(9), -0.1 - 0.45 * random_unit(),
                      1 + (int)random_below(8));
        break;
    case 1:
        cells = true_chazelle(s, 2 + (int)random_below(4), pow(10, -2.5 * random_unit() - 0.5),
                              0.05 + 0.4 * random_unit());
        break;
    case 2:
        cells = needles(s);
        break;
    case 3:
        cells = fans(s);
        break;
    case 4:
        cells = plates(s);
        break;
    case 5:
        cells = near_spheres(s);
        break;
    case 6:
        cells = cospherical(s);
        break;
    case 7:
        cells = fibres(s);
        break;
    case 8:
        cells = lattice(s);
        break;
    case 9:
        split_box(s, 1 + (int)random_below(3), (int)random_below(500));
        break;
    case 10:
        random_ball(s, 5 + random_below(8), 0.6 * random_unit());
        stretch(s, pow(10, 2.5 * random_unit()));
        break;
    default:
        torus(s, 0, 0, 12 + random_below(9), 5 + random_below(4), 0.3 + 0.12 * random_unit());
        torus(s, 1, 1, 12 + random_below(9), 5 + random_below(4), 0.3 + 0.12 * random_unit());
        cells = 2;
    }
    how = random_below(5);
    transform(s, random_below(3) ? 6 * random_unit() : 0, scales[how], shifts[how]);
    return cells;
}

/* -- the runs */

static long recovered, intersecting, failed;
static double longest_seconds;
static uint64_t longest_seed;

static void run(uint64_t seed)
{
    static mesher_finding findings[4];
    mesher_surface surface;
    mesher_options options;
    mesher_report report, check;
    mesher_domain domain;
    mesher_output out;
    mesher_result result;
    const char *wrong = NULL;
    shape s = {0};
    uint64_t cells = hard_case(&s, seed);
    double seconds;
    clock_t start = clock();
    memset(&options, 0, sizeof options);
    memset(&report, 0, sizeof report);
    memset(&check, 0, sizeof check);
    memset(&domain, 0, sizeof domain);
    memset(&out, 0, sizeof out);
    surface = surface_of(&s);
    options.no_refine = 1;
    options.host.num_threads = 1;
    report.findings = findings;
    report.cap_findings = 4;
    result = mesher_mesh(&domain, &surface, &options, &report);
    seconds = (double)(clock() - start) / CLOCKS_PER_SEC;
    if (seconds > longest_seconds) {
        longest_seconds = seconds;
        longest_seed = seed;
    }
    if (seconds > 5) printf("seed %lu: %.1f s\n", (unsigned long)seed, seconds);
    if (result == MESHER_OK && mesher_export(&domain, &out) == MESHER_OK)
        wrong = offence(&s, &out, cells);
    if (wrong) printf("seed %lu: %s\n", (unsigned long)seed, wrong);
    CHECK(!wrong);
    if (result == MESHER_ERROR_SURFACE) {
        intersecting++;
        CHECK(mesher_check(&surface, &options, &check) == MESHER_ERROR_SURFACE);
    } else if (result == MESHER_ERROR_RECOVERY) {
        failed++;
    } else {
        CHECK(result == MESHER_OK);
        recovered++;
    }
    if (result != MESHER_OK)
        printf("seed %lu: %s: %s\n", (unsigned long)seed, mesher_result_string(result),
               report.message);
    mesher_output_free(&domain, &out);
    mesher_domain_free(&domain);
    shape_free(&s);
}

/* The same where one allocation after another fails, and with it all later ones or none. */
typedef struct scarce {
    long calls, fail_at, live;
    int for_good;
} scarce;

static void *scarce_alloc(void *user, size_t size)
{
    scarce *a = (scarce *)user;
    long call = a->calls++;
    void *block = NULL;
    if (a->for_good ? call < a->fail_at : call != a->fail_at) block = malloc(size ? size : 1);
    a->live += block != NULL;
    return block;
}

static void scarce_release(void *user, void *block)
{
    ((scarce *)user)->live -= block != NULL;
    free(block);
}

static void run_without_memory(uint64_t seed)
{
    mesher_surface surface;
    mesher_options options;
    mesher_report report;
    mesher_domain domain;
    mesher_result result;
    scarce a = {0, 0, 0, 0};
    shape s = {0};
    hard_case(&s, seed);
    memset(&options, 0, sizeof options);
    memset(&report, 0, sizeof report);
    surface = surface_of(&s);
    options.no_refine = 1;
    options.host.num_threads = 1;
    options.host.allocator.alloc = scarce_alloc;
    options.host.allocator.release = scarce_release;
    options.host.allocator.user = &a;
    for (; a.calls >= a.fail_at; a.fail_at += a.for_good, a.for_good ^= 1) {
        a.calls = 0;
        memset(&domain, 0, sizeof domain);
        result = mesher_mesh(&domain, &surface, &options, &report);
        CHECK(result == MESHER_ERROR_OUT_OF_MEMORY || result == MESHER_OK);
        mesher_domain_free(&domain);
        CHECK(a.live == 0);
    }
    CHECK(a.fail_at > 50);
    shape_free(&s);
}

/* Blocks full of small numbers, as after other uses. */
static void *used_alloc(void *user, size_t size)
{
    static const uint32_t remains[3] = {7, 8, 0x40000000};
    uint32_t *block = (uint32_t *)malloc(size + sizeof *block);
    size_t i;
    (void)user;
    for (i = 0; block && i < size / sizeof *block; i++)
        block[i] = remains[((uint64_t)(i + 1) * i * 6364136223846793005u >> 40) % 3];
    return block;
}

static void used_release(void *user, void *block)
{
    (void)user;
    free(block);
}

/* A polyhedron with more and more missing edges, as points split them: the room for threads grows
 * more than once. */
static void room_for_threads_grows_again(void)
{
    shape s = {0};
    mesher_surface surface;
    mesher_options options;
    mesher_domain domain;
    mesher_output out;
    uint64_t cells;
    state = 12345;
    cells = true_chazelle(&s, 12, 1e-4, 0.1);
    surface = surface_of(&s);
    memset(&options, 0, sizeof options);
    options.no_refine = 1;
    options.host.num_threads = 6;
    options.host.allocator.alloc = used_alloc;
    options.host.allocator.release = used_release;
    CHECK(mesher_mesh(&domain, &surface, &options, NULL) == MESHER_OK);
    CHECK(mesher_export(&domain, &out) == MESHER_OK && !offence(&s, &out, cells));
    mesher_output_free(&domain, &out);
    mesher_domain_free(&domain);
    shape_free(&s);
}

/* A needle of three sides from p to q. */
static void add_needle(shape *s, const double *p, const double *q, double radius)
{
    const double turn = 6.283185307179586 / 3, angle = turn * random_unit();
    const double *end[2];
    double along[3], u[3], v[3], length = 0, across;
    uint32_t base = (uint32_t)s->num_vertices, i, j, k;
    end[0] = p;
    end[1] = q;
    for (k = 0; k < 3; k++) {
        along[k] = q[k] - p[k];
        length += along[k] * along[k];
    }
    length = sqrt(length);
    for (k = 0; k < 3; k++) along[k] /= length;
    across = sqrt(along[0] * along[0] + along[1] * along[1]); /* no needle is upright */
    u[0] = -along[1] / across, u[1] = along[0] / across, u[2] = 0;
    for (k = 0; k < 3; k++)
        v[k] = along[(k + 1) % 3] * u[(k + 2) % 3] - along[(k + 2) % 3] * u[(k + 1) % 3];
    for (i = 0; i < 6; i++) {
        double c = radius * cos(angle + turn * (i % 3)), d = radius * sin(angle + turn * (i % 3)),
               x[3];
        for (k = 0; k < 3; k++) x[k] = end[i / 3][k] + c * u[k] + d * v[k];
        add_vertex(s, x[0], x[1], x[2]);
    }
    for (i = 0; i < 3; i++) {
        j = (i + 1) % 3;
        add_triangle(s, base + i, base + j, base + 3 + j);
        add_triangle(s, base + i, base + 3 + j, base + 3 + i);
    }
    add_triangle(s, base, base + 2, base + 1);
    add_triangle(s, base + 3, base + 4, base + 5);
}

/* The surface, of so many cells, comes in. It is freed. */
static void comes_in(shape *s, uint32_t cells)
{
    mesher_surface surface = surface_of(s);
    mesher_options options;
    mesher_domain domain;
    mesher_output out;
    memset(&options, 0, sizeof options);
    options.no_refine = 1;
    CHECK(mesher_mesh(&domain, &surface, &options, NULL) == MESHER_OK);
    CHECK(mesher_export(&domain, &out) == MESHER_OK && !offence(s, &out, cells));
    mesher_output_free(&domain, &out);
    mesher_domain_free(&domain);
    shape_free(s);
}

/* Needles along the lines of two hyperboloids, one within the other: most of their edges are
 * missing, each crosses many others, and they come in by thousands of points on them. */
static void needles_come_in(void)
{
    enum { EACH = 44 };
    shape s = {0};
    int i, k;
    state = 2;
    for (i = 0; i < EACH; i++)
        for (k = 0; k < 2; k++) {
            double a = 6.283185307179586 * i / EACH, b = a + (k ? 2.2 : -2.2), r = k ? 1 : 1.15,
                   p[3], q[3];
            p[0] = r * cos(a), p[1] = r * sin(a), p[2] = -1;
            q[0] = r * cos(b), q[1] = r * sin(b), q[2] = 1;
            add_needle(&s, p, q, 0.001);
        }
    comes_in(&s, 2 * EACH);
}

/* Are two boxes, each of its least and its greatest corner, disjoint? */
static int are_apart(const double *a, const double *b)
{
    int k;
    for (k = 0; k < 3; k++)
        if (a[k] > b[3 + k] || b[k] > a[3 + k]) return 1;
    return 0;
}

/* Rods in three directions, hundreds of times as long as wide, past each other: their sides are
 * split into pieces that lie in one plane, some hundreds of times over. */
static void rods_come_in(void)
{
    enum { RODS = 70 };
    double rods[RODS][6];
    shape s = {0};
    uint32_t n = 0, i;
    int k;
    state = 106;
    while (n < RODS) {
        double *rod = rods[n];
        for (k = 0; k < 3; k++) {
            int along = k == (int)(n % 3);
            rod[k] = along ? -0.02 * random_unit() : random_unit();
            rod[3 + k] = rod[k] + (along ? 1 : 0.003 * (0.5 + 0.5 * random_unit()));
        }
        for (i = 0; i < n && are_apart(rods[i], rod); i++) {}
        if (i < n) continue;
        add_box(&s, rod, rod + 3);
        n++;
    }
    comes_in(&s, RODS);
}

/* The checker knows what is wrong. */
static void the_checker_sees_offences(void)
{
    double xyz[15] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 1};
    uint32_t triangles[18] = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 4, 2, 3, 4, 3, 1, 4},
             tets[8] = {0, 1, 2, 3, 1, 4, 2, 3}, regions[2] = {1, 1}, t;
    double a[3] = {0, 0, 0}, b[3] = {1, 1e-30, 0}, c[3] = {1, 2e-30, 1e-20};
    shape s = {0};
    mesher_output out;
    memset(&out, 0, sizeof out);
    s.xyz = out.xyz = xyz;
    s.num_vertices = 5;
    out.num_vertices = 5;
    s.triangles = triangles;
    s.num_triangles = 6;
    out.tets = tets;
    out.num_tets = 2;
    out.regions = regions;
    tets[5] = 2;
    tets[6] = 4;
    CHECK(offence(&s, &out, 1) != NULL); /* inverted */
    tets[5] = 4;
    tets[6] = 2;
    if (orientation(xyz + 3, xyz + 12, xyz + 6, xyz + 9) < 0) {
        tets[5] = 2;
        tets[6] = 4;
    }
    CHECK(offence(&s, &out, 1) == NULL);
    CHECK(offence(&s, &out, 2) != NULL);
    t = triangles[17];
    triangles[17] = 0;
    CHECK(offence(&s, &out, 1) != NULL);
    triangles[17] = t;
    regions[1] = 2;
    CHECK(offence(&s, &out, 1) != NULL);
    CHECK(orientation(a, b, c, b) == 0);
    CHECK(orientation(a, xyz + 3, b, c) > 0);
    CHECK(orientation(a, xyz + 3, c, b) < 0);
}

int main(int argc, char **argv)
{
    const char *cases = getenv("HARD_CASES");
    uint64_t first = argc > 2 ? (uint64_t)atol(argv[1]) : 1, seed;
    uint64_t last = argc > 2 ? (uint64_t)atol(argv[2]) : cases ? (uint64_t)atol(cases) : 100;
    the_checker_sees_offences();
    run_without_memory(37); /* a Chazelle polyhedron, for which many windows are looked at */
    room_for_threads_grows_again();
    needles_come_in();
    rods_come_in();
    for (seed = first; seed <= last; seed++) run(seed);
    printf("seeds %lu to %lu: %ld recovered, %ld intersect themselves, %ld failed; the longest, "
           "seed %lu, %.1f s\n",
           (unsigned long)first, (unsigned long)last, recovered, intersecting, failed,
           (unsigned long)longest_seed, longest_seconds);
    CHECK(200 * failed <= recovered + intersecting + failed);
    CHECK(10 * intersecting <= recovered + intersecting + failed);
    return check_report();
}
