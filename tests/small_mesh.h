/* small_mesh.h - small meshes for tests: built from arrays and checked, both by brute force. After
 * delaunay.h. */
#ifndef SMALL_MESH_H
#define SMALL_MESH_H
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

static uint64_t small_state = 88172645463325252u;
/* A random number in 0 .. n-1. */
DELAUNAY_INLINE uint32_t small_random(uint64_t n)
{
    small_state ^= small_state << 13;
    small_state ^= small_state >> 7;
    small_state ^= small_state << 17;
    return (uint32_t)((small_state >> 33) % n);
}

/* An allocator that counts the blocks in use, and of which all allocations fail after the first
 * `countdown` ones (negative: none fails). */
typedef struct small_allocator {
    long countdown, outstanding;
} small_allocator;
DELAUNAY_INLINE void *small_alloc(void *user, size_t size)
{
    small_allocator *a = (small_allocator *)user;
    if (a->countdown == 0) return NULL;
    if (a->countdown > 0) a->countdown--;
    a->outstanding++;
    return malloc(size);
}
DELAUNAY_INLINE void small_release(void *user, void *block)
{
    ((small_allocator *)user)->outstanding--;
    free(block);
}

/* Sorts three numbers; returns the parity of the permutation. */
static int small_sort3(uint32_t *v)
{
    int odd = 0, i, j;
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

static void small_facet(const delaunay_mesh *m, delaunay_handle f, uint32_t *v)
{
    int k;
    for (k = 0; k < 3; k++) v[k] = m->tets[f / 4].v[delaunay_facet_order((int)(f % 4))[k]];
}

/* Sets the facet handles by comparing the vertices of all pairs of facets: quadratic, for meshes of
 * some hundred tetrahedra. */
static void small_link(delaunay_mesh *m)
{
    delaunay_handle f, g;
    for (f = 4; f < 4 * m->num_tets; f++) m->tets[f / 4].n[f % 4] = 0;
    for (f = 4; f < 4 * m->num_tets; f++)
        for (g = f + 1; g < 4 * m->num_tets && !m->tets[f / 4].n[f % 4]; g++) {
            uint32_t a[3], b[3];
            small_facet(m, f, a);
            small_facet(m, g, b);
            if (small_sort3(a) == small_sort3(b) || memcmp(a, b, sizeof a)) continue;
            m->tets[f / 4].n[f % 4] = g;
            m->tets[g / 4].n[g % 4] = f;
        }
}

/* Makes a mesh from arrays. The points become the vertices from 1 on; `tets` has indices of points,
 * from 0; tetrahedra are oriented positively. `ghosts`: ghosts close the hull. 0 on failure. */
DELAUNAY_INLINE int small_mesh(delaunay_mesh *m, const delaunay_host *host, const double *xyz,
                               uint32_t num_points, const uint32_t *tets, uint32_t num_tets,
                               int ghosts)
{
    uint32_t i, k;
    delaunay_handle f;
    memset(m, 0, sizeof *m);
    if (delaunay_memory_init(&m->memory, host) != DELAUNAY_OK) return 0;
    if (delaunay_reserve(m, num_points + 1, (size_t)num_tets * 5 + 1) != DELAUNAY_OK) return 0;
    for (i = 0; i < num_points; i++) delaunay_add_vertex(m, xyz + 3 * i, i);
    for (i = 0; i < num_tets; i++) {
        delaunay_tet *t = &m->tets[m->num_tets++];
        for (k = 0; k < 4; k++) t->v[k] = tets[4 * i + k] + 1;
        if (delaunay_orient3d(m->vertices[t->v[0]].x, m->vertices[t->v[1]].x,
                              m->vertices[t->v[2]].x, m->vertices[t->v[3]].x) < 0) {
            k = t->v[0];
            t->v[0] = t->v[1];
            t->v[1] = k;
        }
    }
    small_link(m);
    if (ghosts) {
        delaunay_handle last = 4 * m->num_tets;
        for (f = 4; f < last; f++)
            if (!m->tets[f / 4].n[f % 4]) {
                small_facet(m, f, m->tets[m->num_tets].v);
                m->tets[m->num_tets++].v[3] = 0;
            }
        small_link(m);
    }
    return delaunay_enable_marks(m) == DELAUNAY_OK && delaunay_link_vertices(m) == DELAUNAY_OK;
}

/* Six times the volume; exact for small integer coordinates. */
static double small_volume(const delaunay_mesh *m, delaunay_handle t)
{
    const double *a = m->vertices[m->tets[t].v[0]].x;
    double e[3][3];
    int i, k;
    for (i = 0; i < 3; i++)
        for (k = 0; k < 3; k++) e[i][k] = m->vertices[m->tets[t].v[i + 1]].x[k] - a[k];
    return e[0][0] * (e[1][1] * e[2][2] - e[1][2] * e[2][1]) +
           e[0][1] * (e[1][2] * e[2][0] - e[1][0] * e[2][2]) +
           e[0][2] * (e[1][0] * e[2][1] - e[1][1] * e[2][0]);
}

DELAUNAY_INLINE int small_is_positive(const delaunay_mesh *m, delaunay_handle t)
{
    const uint32_t *v = m->tets[t].v;
    return delaunay_orient3d(m->vertices[v[0]].x, m->vertices[v[1]].x, m->vertices[v[2]].x,
                             m->vertices[v[3]].x) > 0;
}

DELAUNAY_INLINE double small_total(const delaunay_mesh *m)
{
    double sum = 0;
    delaunay_handle t;
    for (t = 1; t < m->num_tets; t++)
        if (!delaunay_is_deleted(m, t) && !delaunay_is_ghost(m, t)) sum += small_volume(m, t);
    return sum;
}

/* Is the mesh valid? Tetrahedra are positive; facet handles are mutual, and join facets of the same
 * vertices and opposite orientation, whose marks agree; vertex_tet has the vertex. */
DELAUNAY_INLINE int small_valid(const delaunay_mesh *m)
{
    delaunay_handle t;
    uint32_t v, i;
    for (t = 1; t < m->num_tets; t++) {
        if (delaunay_is_deleted(m, t)) continue;
        if (!delaunay_is_ghost(m, t) && !small_is_positive(m, t)) return 0;
        for (i = 0; i < 4; i++) {
            delaunay_handle h = m->tets[t].n[i];
            uint32_t a[3], b[3];
            if (!h) continue;
            if (h / 4 >= m->num_tets || delaunay_is_deleted(m, h / 4)) return 0;
            if (m->tets[h / 4].n[h % 4] != 4 * t + i) return 0;
            small_facet(m, 4 * t + i, a);
            small_facet(m, h, b);
            if (small_sort3(a) == small_sort3(b) || memcmp(a, b, sizeof a)) return 0;
            if (m->flags && !(m->flags[t] & DELAUNAY_FACET_BIT(i)) !=
                                !(m->flags[h / 4] & DELAUNAY_FACET_BIT(h % 4)))
                return 0;
        }
    }
    if (m->vertex_tet)
        for (v = 0; v < m->num_vertices; v++)
            if (m->vertex_tet[v] && delaunay_local_index(&m->tets[m->vertex_tet[v]], v) < 0)
                return 0;
    return 1;
}

/* Inserts vertex v, which has been added to the mesh, by brute force: its star replaces all
 * tetrahedra whose circumspheres contain it. Needs a mesh without ghosts that contains the point.
 * Returns the result of delaunay_replace. */
DELAUNAY_INLINE delaunay_result small_insert(delaunay_mesh *m, delaunay_worker *w, uint32_t v)
{
    delaunay_handle *old = (delaunay_handle *)malloc(m->num_tets * sizeof *old), t, n = 0;
    uint32_t *tets = (uint32_t *)malloc((size_t)m->num_tets * 16 * sizeof *tets), num = 0, i, j;
    delaunay_result result;
    for (t = 1; t < m->num_tets; t++) {
        const uint32_t *q = m->tets[t].v;
        if (!delaunay_is_deleted(m, t) &&
            delaunay_insphere_perturbed(m->vertices[q[0]].x, m->vertices[q[1]].x,
                                        m->vertices[q[2]].x, m->vertices[q[3]].x,
                                        m->vertices[v].x) > 0)
            old[n++] = t;
    }
    for (j = 0; j < n; j++)
        for (i = 0; i < 4; i++) {
            delaunay_handle u = m->tets[old[j]].n[i] / 4, k;
            uint32_t f[3];
            for (k = 0; k < n && old[k] != u; k++) {}
            if (u && k < n) continue;
            small_facet(m, 4 * old[j] + i, f);
            tets[4 * num] = f[0];
            tets[4 * num + 1] = f[2];
            tets[4 * num + 2] = f[1];
            tets[4 * num++ + 3] = v;
        }
    result = delaunay_replace(m, w, old, n, tets, num, NULL);
    free(old);
    free(tets);
    return result;
}

/* Delaunay triangulation of n random points with coordinates 0..99 inside one big tetrahedron;
 * vertices 1-4 are its corners. No ghosts: the outer facets have no neighbour. */
DELAUNAY_INLINE int small_delaunay(delaunay_mesh *m, delaunay_worker **w, const delaunay_host *host,
                                   uint32_t n)
{
    static const double corners[12] = {-400, -400, -400, 1600, -400, -400,
                                       -400, 1600, -400, -400, -400, 1600};
    static const uint32_t tet[4] = {0, 1, 2, 3};
    uint32_t i, k;
    if (!small_mesh(m, host, corners, 4, tet, 1, 0)) return 0;
    *w = delaunay_worker_new(&m->memory);
    if (!*w) return 0;
    for (i = 0; i < n; i++) {
        double x[3];
        uint32_t v;
        for (k = 0; k < 3; k++) x[k] = small_random(100);
        for (v = 1; v < m->num_vertices && memcmp(m->vertices[v].x, x, sizeof x); v++) {}
        if (v < m->num_vertices) continue;
        v = delaunay_add_vertex(m, x, 4 + i);
        if (!v || small_insert(m, *w, v) != DELAUNAY_OK) return 0;
    }
    return 1;
}
#endif
