/* The demo's surface: closed, manifold, oriented, of genus 7, with the volume of the part that it
 * models. */
#define MESHIO_IMPLEMENTATION
#include "examples/meshio.h"
#include "examples/demo_part.h"
#include "check.h"

typedef struct half_edge {
    uint32_t a, b;
} half_edge;

static int compare(const void *pa, const void *pb)
{
    const half_edge *x = (const half_edge *)pa, *y = (const half_edge *)pb;
    if (x->a != y->a) return x->a < y->a ? -1 : 1;
    return x->b < y->b ? -1 : x->b > y->b;
}

/* In the flat faces no triangle is turned over; with the closed border, none overlaps another. */
static int flat_faces_are_flat(const meshio_mesh *m)
{
    size_t t;
    for (t = 0; t < m->num_triangles; t++) {
        const double *a = m->xyz + 3 * (size_t)m->triangles[3 * t];
        const double *b = m->xyz + 3 * (size_t)m->triangles[3 * t + 1];
        const double *c = m->xyz + 3 * (size_t)m->triangles[3 * t + 2];
        double area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        int tag = m->triangle_tags[t];
        if (tag != DEMO_PART_BOTTOM && tag != DEMO_PART_PLATE) continue;
        if (a[2] != b[2] || a[2] != c[2] || (tag == DEMO_PART_PLATE ? area : -area) <= 1e-6)
            return 0;
    }
    return 1;
}

/* Every directed edge once, and its opposite once. */
static int is_closed_and_oriented(const meshio_mesh *m)
{
    size_t n = 3 * m->num_triangles, i;
    half_edge *edges = (half_edge *)malloc(n * sizeof *edges);
    int ok = 1;
    for (i = 0; i < n; i++) {
        edges[i].a = m->triangles[i];
        edges[i].b = m->triangles[i % 3 == 2 ? i - 2 : i + 1];
    }
    qsort(edges, n, sizeof *edges, compare);
    for (i = 0; i < n && ok; i++) {
        half_edge twin;
        twin.a = edges[i].b;
        twin.b = edges[i].a;
        ok = (i == 0 || compare(&edges[i - 1], &edges[i]) != 0) && edges[i].a != edges[i].b &&
             bsearch(&twin, edges, n, sizeof *edges, compare) != NULL;
    }
    free(edges);
    return ok;
}

static double volume(const meshio_mesh *m)
{
    double sum = 0;
    size_t t;
    for (t = 0; t < m->num_triangles; t++) {
        const double *a = m->xyz + 3 * (size_t)m->triangles[3 * t];
        const double *b = m->xyz + 3 * (size_t)m->triangles[3 * t + 1];
        const double *c = m->xyz + 3 * (size_t)m->triangles[3 * t + 2];
        sum += a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) +
               a[2] * (b[0] * c[1] - b[1] * c[0]);
    }
    return sum / 6;
}

static void part_is_a_closed_surface(int level)
{
    meshio_mesh m;
    const double pi = 3.14159265358979;
    /* plate, hub and fillet less the bore and the bolt holes; edges rounded */
    double drawn = pi * 80 * 80 * 14 + pi * 32 * 32 * 32 - pi * 20 * 20 * 46 - 6 * pi * 7 * 7 * 14;
    double euler;
    size_t t;
    int tags[16] = {0}, k;
    CHECK(demo_part_make(&m, level));
    CHECK(m.num_triangles > 10000 && is_closed_and_oriented(&m));
    CHECK(flat_faces_are_flat(&m));
    euler = (double)m.num_vertices - (double)m.num_triangles / 2;
    CHECK(euler == -12); /* V - E + F of genus 7, every vertex used */
    CHECK(fabs(volume(&m) / drawn - 1) < 0.02);
    for (t = 0; t < m.num_triangles; t++) tags[m.triangle_tags[t]]++;
    for (k = DEMO_PART_BOTTOM; k < DEMO_PART_BOLT_HOLE + DEMO_PART_HOLES; k++) CHECK(tags[k] > 0);
    CHECK(tags[0] == 0);
    printf("level %d: %lu vertices, %lu triangles\n", level, (unsigned long)m.num_vertices,
           (unsigned long)m.num_triangles);
    meshio_free(&m);
}

int main(void)
{
    part_is_a_closed_surface(1);
    part_is_a_closed_surface(2);
    part_is_a_closed_surface(5);
    return check_report();
}
