/* Stars, searches, point location, replacement of a cavity, marks: compared with brute force on
 * small meshes. */
#ifndef LINKED
#  define DELAUNAY_IMPLEMENTATION
#endif
#include "../delaunay.h"
#include "check.h"
#include "small_mesh.h"

static void stars_are_complete(void)
{
    delaunay_mesh m;
    delaunay_worker *w = NULL;
    delaunay_list star;
    uint32_t v, u, q, n;
    delaunay_handle t;
    memset(&star, 0, sizeof star);
    CHECK(small_delaunay(&m, &w, NULL, 60));
    CHECK(small_valid(&m));
    CHECK(small_total(&m) == 8e9);
    for (v = 1; v < m.num_vertices; v++) {
        for (n = 0, t = 1; t < m.num_tets; t++)
            n += !delaunay_is_deleted(&m, t) && delaunay_local_index(&m.tets[t], v) >= 0;
        CHECK(delaunay_vertex_star(&m, w, v, &star) == DELAUNAY_OK && star.count == n);
        for (u = 1; u < m.num_vertices; u++) {
            size_t i;
            if (u == v) continue;
            for (n = 0, t = 1; t < m.num_tets; t++)
                n += !delaunay_is_deleted(&m, t) && delaunay_local_index(&m.tets[t], v) >= 0 &&
                     delaunay_local_index(&m.tets[t], u) >= 0;
            t = delaunay_find_edge(&m, w, v, u);
            CHECK(!t == !n);
            if (!t) continue;
            CHECK(delaunay_edge_star(&m, w, t, v, u, &star) == DELAUNAY_OK && star.count == n);
            for (i = 0; i + 1 < star.count; i++) { /* consecutive ones are neighbours */
                const delaunay_tet *a = &m.tets[star.items[i]];
                CHECK(a->n[0] / 4 == star.items[i + 1] || a->n[1] / 4 == star.items[i + 1] ||
                      a->n[2] / 4 == star.items[i + 1] || a->n[3] / 4 == star.items[i + 1]);
            }
            q = 1 + small_random(m.num_vertices - 1);
            if (q == u || q == v) continue;
            for (n = 0, t = 1; t < m.num_tets; t++)
                n += !delaunay_is_deleted(&m, t) && delaunay_local_index(&m.tets[t], v) >= 0 &&
                     delaunay_local_index(&m.tets[t], u) >= 0 &&
                     delaunay_local_index(&m.tets[t], q) >= 0;
            t = delaunay_find_facet(&m, w, v, u, q);
            CHECK(!t == !n);
            if (t) {
                uint32_t f[3], g[3];
                small_facet(&m, t, f);
                g[0] = u;
                g[1] = v;
                g[2] = q;
                small_sort3(f);
                small_sort3(g);
                CHECK(!memcmp(f, g, sizeof f));
            }
        }
    }
    delaunay_list_free(&star);
    delaunay_worker_free(w);
    delaunay_mesh_free(&m);
}

/* Edges and facets of ghosts, the ghost named first, second or last. */
/* Without a tetrahedron of each vertex no star is found, nor taken for an empty one; linked again,
 * a vertex that has left all tetrahedra has none. */
static void stars_need_links(void)
{
    static const double xyz[15] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0.2, 0.2, 0.2};
    static const uint32_t tets[4] = {0, 1, 2, 3};
    delaunay_mesh m;
    delaunay_worker *w;
    delaunay_list star;
    delaunay_handle *links;
    memset(&star, 0, sizeof star);
    CHECK(small_mesh(&m, NULL, xyz, 5, tets, 1, 0));
    w = delaunay_worker_new(&m.memory);
    CHECK(delaunay_vertex_star(&m, w, 1, &star) == DELAUNAY_OK && star.count == 1);
    m.vertex_tet[5] = 1;
    CHECK(delaunay_link_vertices(&m) == DELAUNAY_OK && m.vertex_tet[5] == 0);
    CHECK(delaunay_vertex_star(&m, w, 5, &star) == DELAUNAY_OK && star.count == 0);
    links = m.vertex_tet;
    m.vertex_tet = NULL;
    CHECK(delaunay_vertex_star(&m, w, 1, &star) == DELAUNAY_ERROR_INVALID_ARGUMENT);
    CHECK(delaunay_find_edge(&m, w, 1, 2) == 0 && delaunay_find_facet(&m, w, 1, 2, 3) == 0);
    m.vertex_tet = links;
    delaunay_list_free(&star);
    delaunay_worker_free(w);
    delaunay_mesh_free(&m);
}

static void what_leads_to_the_ghost_is_found(void)
{
    delaunay_mesh m;
    delaunay_worker *w;
    delaunay_handle t, f;
    double xyz[3 * 60];
    uint32_t v, found[3], expected[3], inner = 0;
    int i, k, on_hull;
    memset(&m, 0, sizeof m);
    for (i = 0; i < 3 * 60; i++) xyz[i] = small_random(400);
    CHECK(delaunay_tetrahedralize(&m, xyz, 60, NULL, NULL) == DELAUNAY_OK);
    CHECK(delaunay_link_vertices(&m) == DELAUNAY_OK);
    w = delaunay_worker_new(&m.memory);
    for (t = 1; t < m.num_tets; t++) {
        const uint32_t *q = m.tets[t].v;
        if (delaunay_is_deleted(&m, t)) continue;
        for (i = 0; i < 3; i++) {
            uint32_t a = q[i], b = q[(i + 1) % 3];
            on_hull = delaunay_is_ghost(&m, t);
            for (f = 4; f < 4 * m.num_tets && !on_hull; f++) /* the edge ab of another ghost? */
                on_hull = !delaunay_is_deleted(&m, f / 4) && delaunay_is_ghost(&m, f / 4) &&
                          delaunay_local_index(&m.tets[f / 4], a) >= 0 &&
                          delaunay_local_index(&m.tets[f / 4], b) >= 0;
            for (k = 0; k < 3; k++) {
                f = k == 0   ? delaunay_find_facet(&m, w, 0, a, b)
                    : k == 1 ? delaunay_find_facet(&m, w, a, 0, b)
                             : delaunay_find_facet(&m, w, a, b, 0);
                CHECK(!f == !on_hull);
                if (!f) continue;
                small_facet(&m, f, found);
                expected[0] = 0;
                expected[1] = a;
                expected[2] = b;
                small_sort3(found);
                small_sort3(expected);
                CHECK(!memcmp(found, expected, sizeof found));
            }
        }
    }
    for (v = 1; v < m.num_vertices; v++) {
        for (on_hull = 0, t = 1; t < m.num_tets; t++)
            on_hull |= !delaunay_is_deleted(&m, t) && delaunay_is_ghost(&m, t) &&
                       delaunay_local_index(&m.tets[t], v) >= 0;
        inner += !on_hull;
        for (k = 0; k < 2; k++) {
            t = k ? delaunay_find_edge(&m, w, 0, v) : delaunay_find_edge(&m, w, v, 0);
            CHECK(!t == !on_hull);
            CHECK(!t || (delaunay_is_ghost(&m, t) && delaunay_local_index(&m.tets[t], v) >= 0));
        }
        CHECK(delaunay_find_facet(&m, w, v, 0, 0) == 0 && delaunay_find_facet(&m, w, 0, 0, v) == 0);
    }
    CHECK(inner > 10 && inner < 50);
    CHECK(delaunay_find_edge(&m, w, 0, 0) == 0 && delaunay_find_facet(&m, w, 0, 0, 0) == 0);
    delaunay_worker_free(w);
    delaunay_mesh_free(&m);
}

static int contains(const delaunay_mesh *m, delaunay_handle t, const double *x)
{
    int i, k;
    for (i = 0; i < 4; i++) {
        const double *p[3];
        for (k = 0; k < 3; k++) p[k] = m->vertices[m->tets[t].v[delaunay_facet_order(i)[k]]].x;
        if (delaunay_orient3d(p[0], p[1], p[2], x) > 0) return 0;
    }
    return 1;
}

static void locate_finds_every_point(void)
{
    static const double cube[24] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0,
                                    0, 0, 1, 1, 0, 1, 0, 1, 1, 1, 1, 1};
    static const uint32_t tets[20] = {0, 1, 2, 4, 3, 1, 2, 7, 5, 1, 4, 7, 6, 2, 4, 7, 1, 2, 4, 7};
    delaunay_mesh m;
    delaunay_worker *w = NULL;
    int i, k, pass;
    CHECK(small_delaunay(&m, &w, NULL, 60));
    for (i = 0; i < 500; i++) {
        double x[3];
        delaunay_handle t;
        for (k = 0; k < 3; k++)
            x[k] = small_random(i < 250 ? 100 : 1600); /* grid points: many on facets */
        t = delaunay_locate(&m, x,
                            i % 3 ? 1 + (delaunay_handle)small_random(m.num_tets - 1) : 0);
        CHECK(x[0] + x[1] + x[2] <= 400 ? t != 0 : 1);
        CHECK(t == 0 || contains(&m, t, x));
    }
    delaunay_worker_free(w);
    delaunay_mesh_free(&m);
    for (pass = 0; pass < 2; pass++) { /* with ghosts, and without */
        CHECK(small_mesh(&m, NULL, cube, 8, tets, 5, pass == 0));
        w = delaunay_worker_new(&m.memory);
        for (i = 0; i < 300; i++) {
            double x[3];
            delaunay_handle t;
            int inside = 1;
            for (k = 0; k < 3; k++) {
                x[k] = (small_random(17) - 4.0) / 8;
                inside = inside && x[k] >= 0 && x[k] <= 1;
            }
            t = delaunay_locate(&m, x, 1 + (delaunay_handle)small_random(m.num_tets - 1));
            if (inside) CHECK(t && !delaunay_is_ghost(&m, t) && contains(&m, t, x));
            else if (pass == 0) CHECK(t && delaunay_is_ghost(&m, t));
            else CHECK(t == 0);
        }
        delaunay_worker_free(w);
        delaunay_mesh_free(&m);
    }
}

/* The links of three new tetrahedra as delaunay_replace made them, for delaunay_replace_linked on
 * the same mesh before: the same in every byte. */
static void known_links_make_the_same(const delaunay_mesh *made, const delaunay_handle *slots,
                                      delaunay_mesh *before, const uint32_t *tets)
{
    delaunay_worker *w = delaunay_worker_new(&before->memory);
    delaunay_handle old[2] = {1, 2}, link[12], at[3];
    uint8_t inside[12];
    uint16_t flags[3];
    delaunay_links links;
    delaunay_handle i, j, k;
    for (i = 0; i < 3; i++) {
        flags[i] = made->flags[slots[i]];
        for (k = 0; k < 4; k++) {
            link[4 * i + k] = made->tets[slots[i]].n[k];
            for (j = 0; j < 3 && slots[j] != link[4 * i + k] / 4; j++) {}
            inside[4 * i + k] = j < 3;
            if (j < 3) link[4 * i + k] = 4 * j + link[4 * i + k] % 4;
        }
    }
    links.link = link;
    links.inside = inside;
    links.flags = flags;
    CHECK(delaunay_replace_linked(before, w, old, 2, tets, &links, 3, at) == DELAUNAY_OK);
    CHECK(!memcmp(at, slots, sizeof at) && before->num_tets == made->num_tets);
    CHECK(small_valid(before));
    CHECK(!memcmp(before->tets, made->tets, made->num_tets * sizeof *made->tets));
    CHECK(!memcmp(before->flags, made->flags, made->num_tets * sizeof *made->flags));
    CHECK(!memcmp(before->color, made->color, made->num_tets * sizeof *made->color));
    CHECK(!memcmp(before->vertex_tet, made->vertex_tet,
                  made->num_vertices * sizeof *made->vertex_tet));
    delaunay_worker_free(w);
}

static void mark_some(delaunay_mesh *m, delaunay_worker *w)
{
    delaunay_mark_facet(m, delaunay_find_facet(m, w, 1, 2, 4), 1);
    delaunay_mark_facet(m, delaunay_find_facet(m, w, 1, 2, 3), 1);
    CHECK(delaunay_mark_edge(m, w, 1, 1, 2, 1) == DELAUNAY_OK);
    CHECK(delaunay_mark_edge(m, w, 1, 3, 4, 1) == DELAUNAY_OK);
}

/* Two tetrahedra become three; everything marked on their hull stays marked, and the shared facet's
 * mark goes. */
static void marks_follow_what_persists(void)
{
    static const double xyz[15] = {0, 0, 0, 4, 0, 0, 0, 4, 0, 1, 1, 4, 1, 1, -4};
    static const uint32_t two[8] = {0, 1, 2, 3, 0, 2, 1, 4};
    static const uint32_t three[12] = {4, 5, 1, 2, 4, 5, 2, 3, 4, 5, 3, 1};
    delaunay_mesh m, again;
    delaunay_worker *w;
    delaunay_handle old[3] = {1, 2, 0}, slots[3], f;
    uint32_t tets[12];
    int i, pass;
    for (pass = 0; pass < 2; pass++) {
        double before;
        CHECK(small_mesh(&m, NULL, xyz, 5, two, 2, pass));
        CHECK(small_mesh(&again, NULL, xyz, 5, two, 2, pass));
        again.color[1] = again.color[2] = 7;
        w = delaunay_worker_new(&m.memory);
        before = small_total(&m);
        m.color[1] = m.color[2] = 7;
        mark_some(&m, w);
        mark_some(&again, w);
        CHECK(small_valid(&m));
        memcpy(tets, three, sizeof tets);
        for (i = 0; i < 3; i++)
            if (delaunay_orient3d(m.vertices[tets[4 * i]].x, m.vertices[tets[4 * i + 1]].x,
                                  m.vertices[tets[4 * i + 2]].x,
                                  m.vertices[tets[4 * i + 3]].x) < 0) {
                uint32_t t = tets[4 * i];
                tets[4 * i] = tets[4 * i + 1];
                tets[4 * i + 1] = t;
            }
        CHECK(delaunay_replace(&m, w, old, 2, tets, 3, slots) == DELAUNAY_OK);
        CHECK(slots[0] == 1 && slots[1] == 2 && slots[2] == m.num_tets - 1);
        known_links_make_the_same(&m, slots, &again, tets);
        delaunay_mesh_free(&again);
        CHECK(small_valid(&m) && small_total(&m) == before);
        CHECK(delaunay_find_facet(&m, w, 1, 2, 3) == 0);
        f = delaunay_find_facet(&m, w, 1, 2, 4);
        CHECK(f && (m.flags[f / 4] & DELAUNAY_FACET_BIT(f % 4)));
        for (i = 0; i < 3; i++) {
            const delaunay_tet *t = &m.tets[slots[i]];
            unsigned flags = m.flags[slots[i]], facets = 0, edges = 0;
            int a, b;
            CHECK(m.color[slots[i]] == 7);
            for (a = 0; a < 4; a++) facets += flags >> a & 1;
            CHECK(facets ==
                  (unsigned)(delaunay_local_index(t, 1) >= 0 && delaunay_local_index(t, 2) >= 0));
            for (a = 0; a < 6; a++) edges += flags >> (4 + a) & 1;
            a = delaunay_local_index(t, 1) >= 0 && delaunay_local_index(t, 2) >= 0;
            b = delaunay_local_index(t, 3) >= 0 && delaunay_local_index(t, 4) >= 0;
            CHECK(edges == (unsigned)(a + b));
        }
        delaunay_mark_facet(&m, f, 0);
        CHECK(!(m.flags[f / 4] & DELAUNAY_FACET_BITS) && small_valid(&m));
        /* and back: a slot becomes free, and is used again */
        for (i = 0; i < 8; i++) tets[i] = two[i] + 1;
        CHECK(delaunay_replace(&m, w, slots, 3, tets, 2, NULL) == DELAUNAY_OK);
        CHECK(small_valid(&m) && small_total(&m) == before && m.num_free == 1);
        CHECK(delaunay_is_deleted(&m, m.free_tets[0]));
        delaunay_worker_free(w);
        delaunay_mesh_free(&m);
    }
}

/* A cavity that includes ghosts: a point beyond the hull. */
static void ghosts_are_replaced_like_others(void)
{
    static const double xyz[15] = {0, 0, 0, 4, 0, 0, 0, 4, 0, 0, 0, 4, 4, 4, 4};
    static const uint32_t tet[4] = {0, 1, 2, 3};
    delaunay_mesh m;
    delaunay_worker *w;
    delaunay_handle t, seen = 0;
    uint32_t f[3], tets[16], i;
    CHECK(small_mesh(&m, NULL, xyz, 5, tet, 1, 1));
    w = delaunay_worker_new(&m.memory);
    for (t = 1; t < m.num_tets; t++)
        if (delaunay_is_ghost(&m, t) &&
            delaunay_orient3d(m.vertices[m.tets[t].v[0]].x, m.vertices[m.tets[t].v[1]].x,
                              m.vertices[m.tets[t].v[2]].x, xyz + 12) > 0)
            seen = t;
    CHECK(seen != 0);
    memcpy(f, m.tets[seen].v, sizeof f);
    for (i = 0; i < 3; i++) tets[i] = f[i];
    tets[3] = 5;
    for (i = 0; i < 3; i++) {
        tets[4 + 4 * i] = f[i];
        tets[5 + 4 * i] = f[(i + 1) % 3];
        tets[6 + 4 * i] = 5;
        tets[7 + 4 * i] = 0;
    }
    CHECK(delaunay_replace(&m, w, &seen, 1, tets, 4, NULL) == DELAUNAY_OK);
    CHECK(small_valid(&m) && delaunay_count_tets(&m) == 2 && m.num_tets == 1 + 2 + 6);
    CHECK(m.vertex_tet[5] != 0);
    delaunay_worker_free(w);
    delaunay_mesh_free(&m);
}

static void what_does_not_close_changes_nothing(void)
{
    delaunay_mesh m;
    delaunay_worker *w = NULL;
    delaunay_tet *copy;
    delaunay_handle old[2], num;
    uint32_t tets[8], i;
    CHECK(small_delaunay(&m, &w, NULL, 30));
    num = m.num_tets;
    copy = (delaunay_tet *)malloc(num * sizeof *copy);
    memcpy(copy, m.tets, num * sizeof *copy);
    for (old[0] = 1; delaunay_is_deleted(&m, old[0]) || !m.tets[old[0]].n[0]; old[0]++) {}
    old[1] = m.tets[old[0]].n[0] / 4;
    memcpy(tets, m.tets[old[0]].v, 16);
    memcpy(tets + 4, m.tets[old[1]].v, 16);
    CHECK(delaunay_replace(&m, w, old, 2, tets, 1, NULL) ==
          DELAUNAY_ERROR_INTERNAL); /* one missing */
    CHECK(delaunay_replace(&m, w, old, 1, tets, 2, NULL) ==
          DELAUNAY_ERROR_INTERNAL); /* one too many */
    i = tets[0];
    tets[0] = tets[1];
    tets[1] = i;
    CHECK(delaunay_replace(&m, w, old, 2, tets, 2, NULL) ==
          DELAUNAY_ERROR_INTERNAL); /* one turned inside out */
    old[1] = old[0];
    CHECK(delaunay_replace(&m, w, old, 2, tets, 2, NULL) == DELAUNAY_ERROR_INVALID_ARGUMENT);
    old[1] = 0;
    CHECK(delaunay_replace(&m, w, old, 2, tets, 2, NULL) == DELAUNAY_ERROR_INVALID_ARGUMENT);
    old[1] = m.num_tets;
    CHECK(delaunay_replace(&m, w, old, 2, tets, 2, NULL) == DELAUNAY_ERROR_INVALID_ARGUMENT);
    CHECK(m.num_tets == num && !memcmp(copy, m.tets, num * sizeof *copy) && small_valid(&m));
    free(copy);
    delaunay_worker_free(w);
    delaunay_mesh_free(&m);
}

static void out_of_memory_leaves_a_valid_mesh(void)
{
    small_allocator a;
    delaunay_host host;
    long k;
    int done = 0;
    memset(&host, 0, sizeof host);
    host.allocator.alloc = small_alloc;
    host.allocator.release = small_release;
    host.allocator.user = &a;
    a.outstanding = 0;
    for (k = 0; !done; k++) {
        delaunay_mesh m;
        delaunay_worker *w = NULL;
        delaunay_list star;
        memset(&star, 0, sizeof star);
        a.countdown = k;
        small_state = 12345;
        done = small_delaunay(&m, &w, &host, 40);
        if (done) done = delaunay_vertex_star(&m, w, 5, &star) == DELAUNAY_OK;
        a.countdown = -1;
        CHECK(m.num_tets == 0 || small_valid(&m));
        if (m.vertex_tet && m.num_vertices > 4) CHECK(small_total(&m) == 8e9);
        delaunay_list_free(&star);
        delaunay_worker_free(w);
        delaunay_mesh_free(&m);
        CHECK(a.outstanding == 0);
    }
    CHECK(k > 15);
}

/* A zeroed mesh is an empty one, for the functions of the expert section too. */
static void a_zeroed_mesh_works(void)
{
    delaunay_mesh m;
    delaunay_worker *w;
    delaunay_engine *engine;
    delaunay_list star;
    const double p[3] = { 1, 2, 3 };
    memset(&m, 0, sizeof m);
    CHECK(delaunay_link_vertices(&m) == DELAUNAY_OK);
    CHECK(delaunay_enable_marks(&m) == DELAUNAY_OK);
    CHECK(delaunay_validate(&m, DELAUNAY_VALIDATE_DELAUNAY, NULL) == DELAUNAY_OK);
    CHECK((engine = delaunay_engine_new(&m, NULL)) != NULL);
    delaunay_engine_free(engine);
    memset(&star, 0, sizeof star);
    star.memory = &m.memory;
    CHECK((w = delaunay_worker_new(&m.memory)) != NULL);
    CHECK(delaunay_list_push(&star, 7) == DELAUNAY_OK && star.count == 1 && star.items[0] == 7);
    CHECK(delaunay_add_vertex(&m, p, 1) == 1 && m.num_vertices == 2);
    delaunay_list_free(&star);
    delaunay_worker_free(w);
    delaunay_mesh_free(&m);
    CHECK(m.memory.bytes == 0);
}

/* Two tetrahedra that share an edge only: its star is in two parts, each is marked by itself. */
static void an_edge_is_marked_in_its_part(void)
{
    const double xyz[18] = {0, 0, 0, 0, 0, 1, 1, 0, 0, 1, 1, 0, -1, 0, 0, -1, -1, 0};
    const uint32_t tets[8] = {0, 1, 2, 3, 0, 1, 4, 5};
    delaunay_mesh m;
    delaunay_worker *w;
    delaunay_handle t;
    memset(&m, 0, sizeof m);
    CHECK(delaunay_import(&m, xyz, 6, tets, NULL, 2, NULL, NULL) == DELAUNAY_OK);
    CHECK(delaunay_enable_marks(&m) == DELAUNAY_OK && delaunay_link_vertices(&m) == DELAUNAY_OK);
    w = delaunay_worker_new(&m.memory);
    for (t = 1; t <= 2; t++) {
        CHECK(m.flags[t] == 0);
        CHECK(delaunay_mark_edge(&m, w, t, 1, 2, 1) == DELAUNAY_OK);
        CHECK(m.flags[t] == DELAUNAY_EDGE_BIT(delaunay_edge_between(
                                delaunay_local_index(&m.tets[t], 1),
                                delaunay_local_index(&m.tets[t], 2))));
    }
    CHECK(delaunay_validate(&m, DELAUNAY_VALIDATE_GEOMETRY, NULL) == DELAUNAY_OK);
    delaunay_worker_free(w);
    delaunay_mesh_free(&m);
}

/* Without memory edges and facets are found all the same: every one of the mesh, from new workers
 * that get nothing for their lists. */
static void found_without_memory(void)
{
    enum { N = 60 };
    double xyz[3 * N];
    small_allocator a;
    delaunay_options options;
    delaunay_mesh m;
    delaunay_handle t;
    uint32_t i;
    memset(&a, 0, sizeof a);
    memset(&m, 0, sizeof m);
    memset(&options, 0, sizeof options);
    a.countdown = -1;
    options.host.allocator.alloc = small_alloc;
    options.host.allocator.release = small_release;
    options.host.allocator.user = &a;
    for (i = 0; i < 3 * N; i++) xyz[i] = small_random(1000000);
    CHECK(delaunay_tetrahedralize(&m, xyz, N, &options, NULL) == DELAUNAY_OK);
    CHECK(delaunay_link_vertices(&m) == DELAUNAY_OK);
    for (t = 1; t < m.num_tets; t++)
        for (i = 0; i < 4; i++) {
            const uint32_t *v = m.tets[t].v;
            const uint8_t *o = delaunay_facet_order((int)i);
            delaunay_worker *w = delaunay_worker_new(&m.memory);
            delaunay_handle found;
            CHECK(w != NULL);
            a.countdown = (long)(t % 3);
            found = delaunay_find_edge(&m, w, v[o[0]], v[o[1]]);
            CHECK(found && delaunay_local_index(&m.tets[found], v[o[0]]) >= 0 &&
                  delaunay_local_index(&m.tets[found], v[o[1]]) >= 0);
            found = delaunay_find_facet(&m, w, v[o[0]], v[o[1]], v[o[2]]);
            CHECK(found == 4 * t + i || found == m.tets[t].n[i]);
            a.countdown = -1;
            delaunay_worker_free(w);
        }
    delaunay_mesh_free(&m);
    CHECK(a.outstanding == 0);
}

int main(void)
{
    an_edge_is_marked_in_its_part();
    a_zeroed_mesh_works();
    stars_are_complete();
    stars_need_links();
    what_leads_to_the_ghost_is_found();
    locate_finds_every_point();
    marks_follow_what_persists();
    ghosts_are_replaced_like_others();
    what_does_not_close_changes_nothing();
    out_of_memory_leaves_a_valid_mesh();
    found_without_memory();
    return check_report();
}
