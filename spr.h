/* spr.h - v0.1.0 - improves tetrahedral meshes by reconnection and smoothing
 *
 *     #define SPR_IMPLEMENTATION          // in one file of your program
 *     #include "spr.h"                    // needs delaunay.h, hilbert.h and hxtsort.h beside it
 *
 *     spr_report report;
 *     spr_improve(&mesh, NULL, &report);  // made by mesher.h; imported: options.free_vertices = 1
 *     spr_improve_arrays(xyz, &nv, cap_v, tets, colors, &nt, ...);  // any mesh in plain arrays
 *
 * CONTENTS (search for the tag)
 *   >>dependencies    how this file finds delaunay.h
 *   >>types           status codes, options, report
 *   >>everyday        improve a mesh, measure a mesh
 *   >>expert          quality of one tetrahedron, reconnection of one polyhedron
 *   >>quality         gamma, SICN, dihedral angles; upper bounds imposed by the surface; statistics
 *   >>smoothing       Laplacian smoothing by golden section       [Marot 2020, 6.1]; ascent of
 *                     the worst quality; relaxation
 *   >>edge removal    edge removal                                [Marot 2020, 6.1]; flips that
 *                     raise the mean quality
 *   >>reconnection    SPR of a growing cavity                     [Marot 2020, 6.2, 6.3]; removal
 *                     and insertion of vertices
 *   >>schedule        which operator is tried when                [Marot 2020, Algorithm 5]
 *   >>shaking         several changes at once, at random
 *   >>stages          the whole schedule; extreme angles, the final sweep for the mean quality
 *   >>public          the everyday functions; reconnection of a polyhedron in arrays
 *
 * WHAT IT DOES NOT DO
 *   The surface, the interfaces between regions, and constrained edges and facets are not changed.
 *   A sharp angle or a needle-shaped triangle of the surface therefore bounds the quality that can
 *   be reached; the report says where it does.
 *   Element sizes are preserved, not created. At most about one vertex is added for every 20
 *   tetrahedra, none where that makes an edge much shorter than those around it; at most about one
 *   is removed for every 12 tetrahedra, besides a few in each shaken patch (where most of the mesh
 *   is bad, that may be most of the vertices; options.keep_vertices prevents it), and no edge
 *   contraction makes an edge much longer.
 *   Limits: those of delaunay.h. The measures are correct for edges of 1e-75 to 1e75; tetrahedra
 *   with edges beyond that count as bad. A thread needs up to 160 KB of stack.
 *
 * HOW IT WORKS
 *   1. Bad tetrahedra are those below the target quality. Each has a level: the next operator to
 *      be tried for it. From the cheapest on, these are: edge removal; smoothing of a vertex, by
 *      golden section and then by an ascent of the worst quality of the star; reconnection of a
 *      cavity that grows around the tetrahedron to 7 to 10 points; removal of one of its vertices,
 *      if necessary with a cavity larger than the star (of more than 20 points only until such
 *      searches have been in vain for long); insertion of a vertex inside it or on one of its
 *      edges, unless reconnection gains as much; reconnection of cavities of up to 16, then up to
 *      32 points; and for the very worst, in the end, insertion and reconnection again with a
 *      longer search. A level runs only when no tetrahedron waits at a cheaper one. A change
 *      sends the bad tetrahedra that it touches back to the first level, a limited number of
 *      times; edges and vertices around which nothing has changed are not tried again. A
 *      tetrahedron that is as good as its facets on the surface allow, as far as a quick search
 *      can tell, is not tried at all.
 *      Each change raises the worst quality of what it replaces, by a margin. A bad tetrahedron
 *      has a weight, which is larger the worse it is, and no change raises the total weight (but
 *      for the very worst): one may be replaced by two that are much better. There are never more
 *      bad tetrahedra than at the start, except for a few more (at most 16, and one in 250 of all)
 *      where some of the worst become better.
 *   2. The worst few, if they are nearly flat or worse than the surface requires anywhere, get
 *      more turns, as long as these change something; here one tetrahedron may be replaced by
 *      many. Flat ones that lie on top of one another, as over a polygon of the surface that
 *      rounding has bent, are then replaced together by tetrahedra around a new vertex.
 *   3. Tidying: fewer bad tetrahedra, and the worst no worse. The closure search now minimises
 *      their number instead of maximising the worst quality.
 *   4. Shaking. A patch of the mesh around a tetrahedron that is far from what the surface allows
 *      (the worst few first, then those with the fewest bad ones beside them) is copied, its
 *      vertices are moved at random, in every second attempt beside a new one, and the copy is
 *      improved. It replaces the patch if it has fewer bad tetrahedra, or if they weigh less. This
 *      goes on as long as it succeeds often enough. (This, and the expensive levels before, have
 *      limits, which are proportional to options.effort.) Finally, vertices are removed where that
 *      leaves fewer bad tetrahedra of a smaller total weight, although the worst quality there may
 *      fall by two fifths (that of the mesh does not fall).
 *   5. Angles, if the measure is gamma. The same is done around the few tetrahedra with the most
 *      extreme dihedral angles and the smallest SICN, in every second attempt by that measure
 *      alone. A much better angle may cost one more bad tetrahedron for each dozen bad ones in the
 *      patch, and at the most extreme of the mesh six more, if all the bad ones together weigh no
 *      more than 1.05 times as much.
 *   6. If nothing is bad now, and the caller has set neither target nor max_rounds: the worst few,
 *      one in 500, are bad once more, for a target that all others reach.
 *   7. The mean. Edges and facets of tetrahedra below the mean quality (if they are too many: of
 *      the worst, about 20000 and one in 64) are flipped where that makes nothing worse that is
 *      bad or extreme. One sweep along a space-filling curve, in blocks that are processed in
 *      parallel, then moves all vertices that gain by it.
 *   Changes are planned in parallel and committed in order (delaunay_speculate). A new position is
 *   accepted only if the exact orientation of every tetrahedron around it is positive.
 *
 * COMPILE-TIME SWITCHES
 *   SPR_IMPLEMENTATION        implementation file  compiles the function bodies, and those of the
 *                                                  three headers that this one needs
 *   SPR_NO_DEPENDENCIES       implementation file  the bodies of those three are in other files
 *   SPR_STATIC                implementation file  all functions are static
 *   DELAUNAY_NO_SIMD, DELAUNAY_INDEX64: see delaunay.h
 *
 * SOURCES
 *   [Freitag 1995]   L. Freitag, M. Jones, P. Plassmann, An efficient parallel algorithm for mesh
 *                    smoothing, International Meshing Roundtable 4
 *   [Klincsek 1980]  G. T. Klincsek, Minimal triangulations of polygonal domains, Annals of
 *                    Discrete Mathematics 9
 *   [Marot 2020]     C. Marot, Parallel tetrahedral mesh generation, thesis
 *   [Shewchuk 2002]  J. R. Shewchuk, Two discrete optimization algorithms for the topological
 *                    improvement of tetrahedral meshes, manuscript
 *
 * LICENCE: MIT or public domain, at the end of the file.
 * SPDX-License-Identifier: MIT OR Unlicense
 */

/* ---- >>dependencies (outside the guard: a second include may ask for bodies) -------------- */
#if defined(SPR_IMPLEMENTATION) && !defined(SPR_NO_DEPENDENCIES)
#  ifndef DELAUNAY_IMPLEMENTATION
#    define DELAUNAY_IMPLEMENTATION
#  endif
#endif
#if defined(SPR_STATIC) && !defined(DELAUNAY_H)
#  define DELAUNAY_STATIC
#endif
#include "delaunay.h"
#if DELAUNAY_VERSION < 100
#  error "spr.h needs delaunay.h 0.1.0 or newer"
#endif

#ifndef SPR_H
#define SPR_H
#define SPR_VERSION 100 /* 10000*major + 100*minor + patch */

#ifndef SPR_API
#  if !defined(SPR_STATIC)
#    define SPR_API extern
#  elif defined(__GNUC__)
#    define SPR_API static __attribute__((unused))
#  else
#    define SPR_API static
#  endif
#endif

#ifdef DELAUNAY_INDEX64
#  define spr_improve        spr_improve_index64
#  define spr_improve_arrays spr_improve_arrays_index64
#  define spr_measure_mesh   spr_measure_mesh_index64
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* ---- >>types ------------------------------------------------------------------------------ */

/* Codes that delaunay_result has too have the same values here. Positive: the mesh is valid. */
typedef enum spr_result {
    SPR_OK                     = 0,
    SPR_STOPPED_BY_BUDGET      = 1,  /* max_seconds or max_rounds was reached */
    SPR_GOAL_NOT_MET           = 2,  /* what the caller asked for was not reached everywhere */
    SPR_ERROR_INVALID_ARGUMENT = -1,
    SPR_ERROR_OUT_OF_MEMORY    = -2,
    SPR_CANCELLED              = -3, /* by host.progress; the mesh is valid and improved so far */
    SPR_ERROR_TOO_LARGE        = -4,
    SPR_ERROR_INTERNAL         = -5,
    SPR_ERROR_INVALID_MESH     = -80 /* arrays that are not a valid mesh: report->message */
} spr_result;

typedef enum spr_measure {
    SPR_GAMMA,        /* sqrt(24) * inradius / longest edge: 1 for the regular tetrahedron */
    SPR_SICN,         /* signed inverse condition number */
    SPR_MIN_DIHEDRAL, /* smallest sine of the six dihedral angles: low for small and large ones */
    SPR_USER          /* options.quality */
} spr_measure;

/* Why a bad tetrahedron is left: the first of these that applies. */
typedef enum spr_reason {
    SPR_BOUNDED, /* the surface allows no better: its facets there, and the angles between them,
                  * keep it below the target. If the call was stopped, this is known only of
                  * tetrahedra that were tried: others have another reason, whatever their bound */
    SPR_FIXED,   /* none of its vertices may move */
    SPR_STUCK,   /* every operator was tried in vain, and nothing around it has changed since */
    SPR_BUDGET   /* not every operator was tried (for example, no more vertices may be removed, or
                  * its facets seemed to allow no better), or not again since something changed
                  * beside it */
} spr_reason;

/* One bad tetrahedron that is left: its quality; the upper bound of the quality of any tetrahedron
 * on its surface facets; its centroid; and its slot in the mesh after the call (spr_improve). */
typedef struct spr_worst {
    double          quality, bound, xyz[3];
    delaunay_handle tet;
    spr_reason      reason;
} spr_worst;

/* Zeros are the recommended setting. */
typedef struct spr_options {
    delaunay_host host;
    spr_measure   measure;
    double        target;      /* tetrahedra of a lower quality are bad; at most 1; 0: 0.35, and if
                                * that is reached everywhere, the worst few become better still */
    double        max_seconds; /* 0: no limit; checked between rounds of plans, about 0.1 s apart */
    int           max_rounds;  /* sweeps over the list of bad ones; 0: until nothing changes */
    /* How long to try on what is bad after the cheapest operators: 0.01 to 100; 0: 1. Twice the
     * effort takes up to twice the time there, and mostly leaves fewer bad ones. */
    double        effort;
    /* Nonzero turns an operator off. no_smoothing also turns off shaking, step 5 of HOW IT WORKS
     * and the final sweep; no_edge_removal also turns off the flips for the mean. Vertices are
     * inserted and removed all the same; keep_vertices turns that off. */
    int           no_smoothing, no_edge_removal, no_reconnection;
    int           keep_vertices;  /* no vertex is added or removed; they may move */
    /* Vertices with an id, which are the caller's own points, may be moved and removed too; by
     * default only those may that mesher.h or this header added. */
    int           free_vertices;
    int           require_target; /* SPR_GOAL_NOT_MET if a tetrahedron is left below the target */
    /* The quality for SPR_USER. Larger is better; at most 1; 0 or less if abcd is inverted. It must
     * be the same for any order of the points that keeps the orientation. Called by several threads
     * at once. */
    double (*quality)(void *user, const double *a, const double *b, const double *c,
                      const double *d);
    void          *quality_user;
    /* Of spr_improve: one byte per mesh vertex; nonzero: it must neither move nor be removed, in
     * addition to those that are fixed anyway. May be NULL. */
    const uint8_t *fixed_vertices;
    /* Of spr_improve_arrays: triangles and edges (3 and 2 vertices each) that must stay although
     * they lie inside one region. Those that the mesh does not have are ignored and counted in
     * report->absent; a vertex number out of range is an error. spr_improve uses the constraint
     * marks of its mesh instead. */
    const uint32_t *kept_triangles, *kept_edges;
    size_t          num_kept_triangles, num_kept_edges;
    /* Called at the end for every bad tetrahedron that is left, by the calling thread, in the same
     * order for any number of threads; may be NULL. Costs 0.2 ms per tetrahedron at most. */
    void (*left)(void *user, const spr_worst *what);
    void *left_user;
} spr_options;

typedef struct spr_statistics {
    uint64_t num_tets, num_below;      /* all, and those below the target */
    double   min, p001, p01, mean;     /* of the measure: minimum, 0.1 % and 1 % quantiles, mean */
    double   sicn_min, gamma_min, dihedral_min_degrees, dihedral_max_degrees;
    uint64_t histogram[20];            /* of the measure, in twenty equal parts of [0, 1] */
    uint64_t dihedral_histogram[18];   /* of all dihedral angles, in steps of 10 degrees */
} spr_statistics;

typedef struct spr_report {
    spr_statistics before, after; /* after: may be all zeros if memory runs out */
    /* numbers of successful operations: */
    uint64_t  smoothed, edges_removed, reconnected;
    uint64_t  vertices_removed, vertices_inserted; /* also by the replacement of patches */
    uint64_t  shaken;  /* patches of the mesh replaced after their vertices were shaken */
    uint64_t  flipped, relaxed; /* for the mean alone: edges and facets flipped, vertices moved */
    uint64_t  rounds, plans, conflicts;          /* of delaunay_speculate */
    uint64_t  bounded, fixed, stuck, unfinished; /* bad tetrahedra left, by spr_reason */
    uint64_t  absent; /* kept_triangles and kept_edges that the mesh does not have */
    spr_worst worst[5];                          /* of those that are left, the worst first */
    int       num_worst;
    double    seconds, seconds_smoothing, seconds_edge_removal, seconds_reconnection;
    size_t    peak_bytes;
    char      message[256];
} spr_report;

/* ---- >>everyday --------------------------------------------------------------------------- */

SPR_API const char *spr_result_string(spr_result result);
/* Improves the worst tetrahedra of every coloured region (all but ghosts if the mesh has no
 * colours). Constrained facets, constrained edges and their vertices are kept, as are facets
 * without a neighbour and facets between colours. The worst quality never falls, the number of bad
 * tetrahedra does not grow (but for a few where some of the worst become better), and no
 * tetrahedron is ever inverted, by exact tests.
 *
 *   mesh     in/out  valid before and, whatever is returned, afterwards; its vertices may be
 *                    renumbered, as those without an id that are no longer used are deleted
 *   options  in      NULL or zeroed: defaults. All vertices of an imported mesh have ids: without
 *                    free_vertices none of them is moved or removed
 *   report   out     may be NULL
 *
 * Returns  SPR_OK; a positive code: stopped by a budget, or the target is not met
 * Cost     depends on what is bad: 0.4-2 us per tetrahedron of a clean mesh, 0.1-2 ms where most
 *          are bad and stay so (up to 60 in the worst small meshes); memory: 32 bytes per slot, 17
 *          per vertex and up to 32 per bad tetrahedron; in the final sweep 24 per slot and 46 per
 *          vertex; from the allocator of the mesh 1-8 MB for each thread, and what the mesh grows
 *          by. options->host.memory_limit_bytes applies to this working memory and, from now on,
 *          to the mesh, each by itself
 * Threads  options->host.num_threads; distinct meshes may be improved at once
 * Repeats  same bytes for any number of threads, except under max_seconds or a memory limit
 * Source   Marot 2020, chapter 6 */
SPR_API spr_result spr_improve(delaunay_mesh *mesh, const spr_options *options, spr_report *report);
/* Statistics of the tetrahedra that are neither ghosts nor outside every region. Of the options,
 * which may be NULL, the measure, the target and the host count. */
SPR_API spr_result spr_measure_mesh(const delaunay_mesh *mesh, const spr_options *options,
                                    spr_statistics *out);
/* Improves a mesh in plain arrays. The boundary, the interfaces between colours, and the
 * kept_triangles and kept_edges of the options stay; all other vertices that are not fixed are free
 * (options->free_vertices and fixed_vertices are ignored).
 *
 *   xyz           in/out  3 doubles per vertex, moved in place; room for cap_vertices
 *   num_vertices  in/out  new vertices are appended; a removed vertex stays in the array, unused
 *   cap_vertices  in      equal to *num_vertices: none is added
 *   tets, colors  in/out  4 vertices, and (colors may be NULL) a region, per tetrahedron; room for
 *                         cap_tets; all positive or all negative, afterwards positive by the
 *                         convention of delaunay.h; any colours but UINT32_MAX
 *   fixed         in      one byte per vertex, nonzero: it must neither move nor be removed; may be
 *                         NULL
 *
 * Returns SPR_ERROR_TOO_LARGE, with the arrays unchanged, if the result needs more than cap_tets;
 *         SPR_ERROR_INVALID_MESH, and SPR_ERROR_INVALID_ARGUMENT for a vertex number out of range,
 *         with the place in report->message; else as spr_improve */
SPR_API spr_result spr_improve_arrays(double *xyz, size_t *num_vertices, size_t cap_vertices,
                                      uint32_t *tets, uint32_t *colors, size_t *num_tets,
                                      size_t cap_tets, const uint8_t *fixed,
                                      const spr_options *options, spr_report *report);

/* ---- >>expert ----------------------------------------------------------------------------- */

/* Quality of one tetrahedron; gamma and SICN are negative if it is inverted. */
SPR_API double spr_gamma(const double *a, const double *b, const double *c, const double *d);
SPR_API double spr_sicn(const double *a, const double *b, const double *c, const double *d);
/* The smallest sine of the six dihedral angles; not positive if the tetrahedron is inverted. */
SPR_API double spr_min_sine(const double *a, const double *b, const double *c, const double *d);
/* Dihedral angles in degrees, in the order of delaunay_edge_order. */
SPR_API void spr_dihedrals(const double *a, const double *b, const double *c, const double *d,
                           double *out6);
/* The best gamma, over all apices, of a tetrahedron that has this triangle as a facet: what a
 * search finds, up to about 1 % less than the best there is. */
SPR_API double spr_gamma_bound(const double *a, const double *b, const double *c);

enum {
    SPR_MAX_POINTS = 32,      /* of a polyhedron */
    SPR_MAX_FACETS = 512,
    SPR_MAX_CONSTRAINTS = 64, /* edges, and as many walls */
    SPR_MAX_RESULT = 400      /* tetrahedra of the result */
};

/* A small polyhedron in the caller's arrays. The facets are its whole boundary, each listed once;
 * they must not cross one another (not checked). It may have tunnels, cavities and several parts,
 * and may touch itself in points and edges. A point that is on no facet is inside, and becomes a
 * vertex of the result. */
typedef struct spr_polyhedron {
    const double   *xyz;        /* 3 per point */
    const uint32_t *facets;     /* 3 points each, counter-clockwise seen from outside */
    const uint32_t *edges;      /* 2 points each: must be in the result */
    const uint32_t *walls;      /* inner triangles, 3 points each in any order: the same */
    size_t          num_points; /* at most SPR_MAX_POINTS */
    size_t          num_facets, num_edges, num_walls;
} spr_polyhedron;

typedef struct spr_reconnection {
    uint32_t nodes;  /* visited nodes of the search tree */
    int      found;  /* there is a result, better than the bound */
    int      proven; /* the search was complete: it is the best, or none is above the bound */
    double   value;  /* worst quality of the result */
    size_t   num_tets;
    uint32_t tets[SPR_MAX_RESULT][4]; /* indices of points; positive */
    char     message[128];            /* what is wrong with the polyhedron */
} spr_reconnection;

/* Small polyhedron reconnection: of all sets of tetrahedra that fill a polyhedron without new
 * points, finds the one whose worst quality is best.
 *
 *   bound      in   the worst quality of the result must be above it; that of the tetrahedra that
 *                   are to be replaced makes the search much shorter; 0: any positive one
 *   max_nodes  in   limit of the nodes of the search tree; 0: 100000
 *   options    in   the measure; NULL: gamma
 *
 * Returns  SPR_OK: found; SPR_GOAL_NOT_MET: not found, and out->proven says whether there is none
 *          or max_nodes was reached; SPR_ERROR_INVALID_ARGUMENT, with out->message
 * Cost     some microseconds for 10 points, milliseconds for 20, and 1 MB of tables per call;
 *          delaunay_reconnect works with a worker of the caller's, on windows of a mesh
 * Threads  any number of calls at once
 * Repeats  same result every time
 * Source   Marot 2020, 6.2 */
SPR_API spr_result spr_reconnect(const spr_polyhedron *polyhedron, double bound, uint32_t max_nodes,
                                 const spr_options *options, spr_reconnection *out);

#ifdef __cplusplus
}
#endif
#endif /* SPR_H */

/* ============================================================================================
 * Readers of the interface can stop here.
 * ============================================================================================ */
#if defined(SPR_IMPLEMENTATION) && !defined(SPR_IMPLEMENTATION_DONE)
#define SPR_IMPLEMENTATION_DONE
#include <math.h>
#include <stdio.h> /* snprintf only */
#include <string.h>

#if defined(__GNUC__) && defined(__x86_64__) && !defined(DELAUNAY_NO_SIMD)
#  include <immintrin.h>
#endif

#if defined(_OPENMP) && defined(__GNUC__)
#  include <omp.h>
#  define SPR__PRAGMA(x) _Pragma(#x)
#  define SPR__OMP(x)    SPR__PRAGMA(x)
#  define SPR__THREAD()  omp_get_thread_num()
#else
#  define SPR__OMP(x)
#  define SPR__THREAD() 0
#endif

/* ---- >>quality ---------------------------------------------------------------------------- */

static double spr__dot(const double *a, const double *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
static void spr__sub(const double *a, const double *b, double *out)
{
    out[0] = a[0] - b[0];
    out[1] = a[1] - b[1];
    out[2] = a[2] - b[2];
}
static void spr__cross(const double *a, const double *b, double *out)
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}
static double spr__max(double a, double b) { return a > b ? a : b; }
static double spr__min(double a, double b) { return a < b ? a : b; }

#if defined(__GNUC__)
#  define SPR__PREFETCH(p) __builtin_prefetch(p)
#else
#  define SPR__PREFETCH(p) ((void)(p))
#endif
/* Four tetrahedra at a time with AVX2; the portable code does the same operations in the same
 * order. */
#if defined(__GNUC__) && defined(__x86_64__) && !defined(DELAUNAY_NO_SIMD)
#  define SPR__AVX2   __builtin_cpu_supports("avx2")
#  define SPR__TARGET __attribute__((target("avx2")))
#else
#  define SPR__AVX2 0
#endif

#define SPR__SQRT24 4.898979485566356

/* What the measures are computed from: the facet normals (their length is twice the area), the
 * squared edge lengths, and det, six times the volume. */
typedef struct spr__shape {
    double normal[4][3], length2[6], det;
} spr__shape;

static void spr__shape_set(spr__shape *s, const double *a, const double *b, const double *c,
                           const double *d)
{
    double e[6][3];
    int i;
    spr__sub(b, a, e[0]);
    spr__sub(c, a, e[1]);
    spr__sub(d, a, e[2]);
    spr__sub(c, b, e[3]);
    spr__sub(d, b, e[4]);
    spr__sub(d, c, e[5]);
    for (i = 0; i < 6; i++) s->length2[i] = spr__dot(e[i], e[i]);
    spr__cross(e[3], e[4], s->normal[0]); /* outward: bcd, adc, abd, acb */
    spr__cross(e[2], e[1], s->normal[1]);
    spr__cross(e[0], e[2], s->normal[2]);
    spr__cross(e[1], e[0], s->normal[3]);
    s->det = -spr__dot(s->normal[3], e[2]);
}

static double spr__shape_gamma(const spr__shape *s)
{
    double area = 0, longest = 0, below;
    int i;
    for (i = 0; i < 4; i++) area += sqrt(spr__dot(s->normal[i], s->normal[i]));
    for (i = 0; i < 6; i++) longest = spr__max(longest, s->length2[i]);
    below = area * sqrt(longest);
    return below > 0 ? SPR__SQRT24 * s->det / below : 0;
}

/* 3 / (|S| |S^-1|), where S maps the regular tetrahedron to this one; the norms are sums of squared
 * edges and of squared areas. */
static double spr__shape_sicn(const spr__shape *s)
{
    double area2 = 0, length2 = 0, below;
    int i;
    for (i = 0; i < 4; i++) area2 += spr__dot(s->normal[i], s->normal[i]);
    for (i = 0; i < 6; i++) length2 += s->length2[i];
    below = sqrt(area2) * sqrt(length2); /* the product overflows from edges of 1e51 on */
    return below > 0 ? 6 * s->det / below : 0;
}

/* Edge e lies between the facets opposite the ends of edge 5-e. */
static double spr__shape_sine(const spr__shape *s)
{
    double area[4], worst = HUGE_VAL, below;
    int i;
    for (i = 0; i < 4; i++) area[i] = sqrt(spr__dot(s->normal[i], s->normal[i]));
    for (i = 0; i < 6; i++) {
        const uint8_t *f = delaunay_edge_order(5 - i);
        below = area[f[0]] * area[f[1]];
        worst = spr__min(worst, below > 0 ? s->det * sqrt(s->length2[i]) / below : 0);
    }
    return worst;
}

SPR_API double spr_gamma(const double *a, const double *b, const double *c, const double *d)
{
    spr__shape s;
    spr__shape_set(&s, a, b, c, d);
    return spr__shape_gamma(&s);
}

SPR_API double spr_sicn(const double *a, const double *b, const double *c, const double *d)
{
    spr__shape s;
    spr__shape_set(&s, a, b, c, d);
    return spr__shape_sicn(&s);
}

SPR_API double spr_min_sine(const double *a, const double *b, const double *c, const double *d)
{
    spr__shape s;
    spr__shape_set(&s, a, b, c, d);
    return spr__shape_sine(&s);
}

SPR_API void spr_dihedrals(const double *a, const double *b, const double *c, const double *d,
                           double *out6)
{
    spr__shape s;
    int i;
    spr__shape_set(&s, a, b, c, d);
    for (i = 0; i < 6; i++) {
        const uint8_t *f = delaunay_edge_order(5 - i);
        out6[i] = atan2(s.det * sqrt(s.length2[i]), -spr__dot(s.normal[f[0]], s.normal[f[1]])) *
                  57.29577951308232;
    }
}

/* Three more measures of a tetrahedron, below 1 if it has a small dihedral angle, a large one, or a
 * low SICN. */
static void spr__shape_extremes(const spr__shape *s, double *out)
{
    double area[4];
    int i;
    for (i = 0; i < 4; i++) area[i] = sqrt(spr__dot(s->normal[i], s->normal[i]));
    out[0] = out[1] = 4;
    for (i = 0; i < 6; i++) {
        const uint8_t *f = delaunay_edge_order(5 - i);
        double below = area[f[0]] * area[f[1]],
               sine = below > 0 ? s->det * sqrt(s->length2[i]) / below : 0;
        if (spr__dot(s->normal[f[0]], s->normal[f[1]]) < 0)
            out[0] = spr__min(out[0], sine * 3.5);  /* 16.6 degrees */
        else out[1] = spr__min(out[1], sine * 1.8); /* 146.3 degrees */
    }
    out[2] = spr__shape_sicn(s) * 2.4;
}

static void spr__extremes(const double *a, const double *b, const double *c, const double *d,
                          double *out)
{
    spr__shape s;
    spr__shape_set(&s, a, b, c, d);
    spr__shape_extremes(&s, out);
}

/* A tetrahedron whose gamma exceeds the target by this much counts as free of extreme angles. */
#define SPR__ROUND 0.15

/* Parameters of spr__measure_all. */
typedef struct spr__focus {
    double target;
    double spare[3];  /* added to the three measures; large: that measure is ignored */
    double low, lift; /* a gamma between low and lift counts as lift, a lower one is multiplied by
                       * lift / low; lift 0: gamma stays as it is */
} spr__focus;

/* Gamma, or the target times the least of the three measures if that is less. user: an spr__focus.
 */
static double spr__measure_all(void *user, const double *a, const double *b, const double *c,
                               const double *d)
{
    const spr__focus *f = (const spr__focus *)user;
    double gamma, e[3];
    spr__shape s;
    int k;
    spr__shape_set(&s, a, b, c, d);
    gamma = spr__shape_gamma(&s);
    if (gamma > f->target + SPR__ROUND) return gamma;
    spr__shape_extremes(&s, e);
    for (k = 0; k < 3; k++) e[k] += f->spare[k];
    if (f->lift > 0) gamma = spr__max(gamma, spr__min(gamma * (f->lift / f->low), f->lift));
    return spr__min(gamma, f->target * spr__min(e[0], spr__min(e[1], e[2])));
}

static double spr__measure_sicn(void *user, const double *a, const double *b, const double *c,
                                const double *d)
{
    (void)user;
    return spr_sicn(a, b, c, d);
}
static double spr__measure_sine(void *user, const double *a, const double *b, const double *c,
                                const double *d)
{
    (void)user;
    return spr_min_sine(a, b, c, d);
}

/* Levels of a bad tetrahedron: the operators in the order in which they are tried. */
enum {
    SPR__EDGES, SPR__SMOOTH, SPR__SMALL, SPR__REMOVE, SPR__INSERT, SPR__MEDIUM, SPR__LARGE,
    SPR__UTMOST,  /* for the very worst */
    SPR__HOPELESS, /* level of a tetrahedron for which everything was tried */
    SPR__GIVEN_UP, /* worse ones used up the plans of its level */
    SPR__MEAN      /* of spr__state.sweep, no level: flips for the mean are running */
};

typedef double (*spr__function)(void *user, const double *a, const double *b, const double *c,
                                const double *d);

/* A case: what has been found out about a bad tetrahedron. */
typedef struct spr__case {
    float    goal;     /* quality that is worth trying for, spr__goal; 0: not known yet */
    uint32_t tried;    /* round of the last failure */
    uint32_t kept;     /* round in which no edge was worth removing */
    uint32_t lifted;   /* round of the last failure while the very worst were lifted */
} spr__case;

/* What is known about the tetrahedron in a slot of the mesh. */
typedef struct spr__slot {
    uint32_t number;   /* of its case; 0: none, which is case 0, all zeros */
    uint8_t  level;    /* the operator that is tried next */
    uint8_t  listed;   /* 1: it is in spr__state.bad; 2: SPR__EXHAUSTED */
    uint8_t  restarts; /* how often it, or what it replaced, went back to the first level */
    uint8_t  shaken;   /* how often a patch around it was shaken; bits SPR__ROUNDED and
                        * SPR__CLAIMED */
} spr__slot;

/* State of the running call; shared by all threads, written between rounds only. */
typedef struct spr__state {
    delaunay_mesh   *mesh;
    delaunay_engine *engine;
    delaunay_memory *memory;
    spr_options      options;     /* a copy */
    spr_report      *report;      /* never NULL */
    spr__function    quality;
    void            *quality_user;
    double           target;
    double           effort;      /* of the options, or 1 */
    double           deadline;    /* by the host's clock, if there is a max_seconds */
    double          *value;       /* by slot: quality; HUGE_VAL: not to be improved */
    spr__slot       *at;          /* by slot; freed before the relaxation */
    spr__case       *cases;       /* by number; freed before the relaxation */
    delaunay_list    free_cases;  /* numbers that are not in use */
    uint32_t         num_cases, cap_cases;
    uint8_t         *left;        /* after the schedule: the spr_reason of each in bad */
    uint32_t        *stamp;       /* by vertex: round of the last change around it */
    uint32_t        *still;       /* by vertex: round in which no better place was found */
    uint32_t        *stays;       /* by vertex: round in which it could not be removed */
    uint32_t        *vain;        /* hash table of cavities that were searched in vain */
    int              vain_bits;   /* the table has 2 to the power of this entries */
    uint64_t         allowance[8]; /* plans left to each level */
    uint64_t         kept_allowance[8]; /* a copy, restored after lifting */
    uint8_t         *movable;     /* by vertex: it may move and be removed */
    delaunay_handle  cap_tets;
    uint32_t         cap_vertices;
    uint32_t         first_new, max_new; /* vertices from first_new on are new: max_new at most */
    uint32_t         room_new;    /* max_new may grow to this */
    uint64_t         gone, max_gone; /* vertices that SPR__REMOVE has removed, and may remove */
    int64_t          refill_credit; /* nodes that large refills may still visit in vain */
    int              credit_ended;  /* there was none at some time: not all was tried */
    double           shown;       /* the fraction of progress so far */
    delaunay_list    bad, items;  /* the work list of bad tetrahedra; those of this round */
    int              sweep;       /* the level that is running */
    uint64_t         num_bad;     /* bad tetrahedra at present */
    uint64_t         tidy_below;  /* if more are bad, a patch is given up, not tidied */
    int              may_add;     /* how many bad ones a change may add in this round */
    int              lift_adds;   /* the same, if it replaces one of the very worst */
    int              nil_adds;    /* the same, if it replaces nil ones (spr__is_nil) */
    size_t           in_flight;   /* changes in a round at most */
    int              tidy;        /* tidying: fewer bad ones count as a gain */
    int              thins;       /* thinning: the same, even if the worst there falls */
    int              raises;      /* raising: the target is higher than the caller's */
    int              lift;        /* lifting: a change need only raise the worst; for a few only */
    int              lifts;       /* turns of lifting so far */
    uint64_t         changes, lifted; /* changes so far; the same at the last turn of lifting */
    uint64_t         lifted_bad;  /* num_bad to which lifting may lead, at most */
    int              is_lifting;  /* a turn of lifting: only what is below lift_below is tried */
    double           lift_below;
    double           held;        /* with lift: what is below this may become many */
    double           relax_floor; /* relaxation: the worst of a star may fall to this */
    double           fair, mean;  /* flips: what is below fair is tried; mean before */
    int              visits;      /* patches to be shaken around one tetrahedron, at most */
    int              is_patch;    /* the mesh is a patch that is shaken */
    delaunay_worker *lent;        /* the worker lent to the patch */
    struct spr__pool *pools;      /* memory for patches, one of each thread */
    size_t           num_pools;
    uint64_t         shakes;      /* plans that patches have taken so far */
    int64_t          shake_credit; /* plans that patches may still take in vain */
    double           least;       /* worst of the mesh before shaking, rounding or thinning */
    int              gamma;       /* the measure is gamma: fast paths */
    int              rounding;    /* the measure is spr__measure_all, with this focus: */
    spr__focus       focus;
    double           extreme[3];  /* the least of each of its three measures in the mesh */
    int              simd;        /* the processor has AVX2 */
    spr_result       failure;     /* set by spr__done */
} spr__state;

static const double *spr__point(const delaunay_mesh *m, uint32_t v) { return m->vertices[v].x; }

/* The vertices of facet f, 4*t+i, ordered so that with corner i of t, or an apex that replaces it,
 * they form a positive tetrahedron. */
static void spr__base(const delaunay_mesh *m, delaunay_handle f, uint32_t *v3)
{
    const uint32_t *v = m->tets[f / 4].v;
    const uint8_t *o = delaunay_facet_order((int)(f % 4));
    v3[0] = v[o[0]];
    v3[1] = v[o[2]];
    v3[2] = v[o[1]];
}

/* The same for the facet opposite vertex v. */
static void spr__base_of(const delaunay_mesh *m, delaunay_handle t, uint32_t v, uint32_t *v3)
{
    spr__base(m, 4 * t + (delaunay_handle)delaunay_local_index(&m->tets[t], v), v3);
}

/* The tetrahedron beyond a facet. */
static delaunay_handle spr__beyond(const delaunay_mesh *m, delaunay_handle f)
{
    return m->tets[f / 4].n[f % 4] / 4;
}

static void spr__middle(const delaunay_mesh *m, delaunay_handle t, double *middle)
{
    const uint32_t *v = m->tets[t].v;
    int k;
    for (k = 0; k < 3; k++)
        middle[k] = (spr__point(m, v[0])[k] + spr__point(m, v[1])[k] + spr__point(m, v[2])[k] +
                     spr__point(m, v[3])[k]) /
                    4;
}

/* Case 0 belongs to all slots without a case of their own and must not be written. */
static spr__case *spr__case_of(const spr__state *s, delaunay_handle t)
{
    return s->cases + s->at[t].number;
}

#if defined(SPR__TARGET)
/* The transpose of four rows: x, y and z of each. */
SPR__TARGET DELAUNAY_INLINE void spr__columns(__m256d r0, __m256d r1, __m256d r2, __m256d r3,
                                              __m256d *x, __m256d *y, __m256d *z)
{
    __m256d s0 = _mm256_unpacklo_pd(r0, r1), s1 = _mm256_unpackhi_pd(r0, r1),
            s2 = _mm256_unpacklo_pd(r2, r3), s3 = _mm256_unpackhi_pd(r2, r3);
    *x = _mm256_permute2f128_pd(s0, s2, 0x20);
    *y = _mm256_permute2f128_pd(s1, s3, 0x20);
    *z = _mm256_permute2f128_pd(s0, s2, 0x31);
}

/* spr_gamma; the four facets are computed side by side. */
SPR__TARGET static double spr__gamma_avx2(const double *a, const double *b, const double *c,
                                          const double *d)
{
    const __m256i xyz = _mm256_set_epi64x(0, -1, -1, -1);
    __m256d va = _mm256_maskload_pd(a, xyz), vb = _mm256_maskload_pd(b, xyz),
            vc = _mm256_maskload_pd(c, xyz), vd = _mm256_maskload_pd(d, xyz),
            e0 = _mm256_sub_pd(vb, va), e1 = _mm256_sub_pd(vc, va), e2 = _mm256_sub_pd(vd, va),
            e3 = _mm256_sub_pd(vc, vb), e4 = _mm256_sub_pd(vd, vb), e5 = _mm256_sub_pd(vd, vc), ux,
            uy, uz, wx, wy, wz, nx, ny, nz, l2;
    double area[4], length2[4], last[4], det[4], longest, below;
    spr__columns(e3, e2, e0, e1, &ux, &uy, &uz);
    spr__columns(e4, e1, e2, e0, &wx, &wy, &wz);
    nx = _mm256_sub_pd(_mm256_mul_pd(uy, wz), _mm256_mul_pd(uz, wy));
    ny = _mm256_sub_pd(_mm256_mul_pd(uz, wx), _mm256_mul_pd(ux, wz));
    nz = _mm256_sub_pd(_mm256_mul_pd(ux, wy), _mm256_mul_pd(uy, wx));
    l2 = _mm256_add_pd(_mm256_add_pd(_mm256_mul_pd(nx, nx), _mm256_mul_pd(ny, ny)),
                       _mm256_mul_pd(nz, nz));
    _mm256_storeu_pd(area, _mm256_sqrt_pd(l2));
    l2 = _mm256_add_pd(_mm256_add_pd(_mm256_mul_pd(ux, ux), _mm256_mul_pd(uy, uy)),
                       _mm256_mul_pd(uz, uz));
    l2 = _mm256_max_pd(l2, _mm256_add_pd(_mm256_add_pd(_mm256_mul_pd(wx, wx),
                                                       _mm256_mul_pd(wy, wy)),
                                         _mm256_mul_pd(wz, wz)));
    _mm256_storeu_pd(length2, l2);
    _mm256_storeu_pd(last, _mm256_mul_pd(e5, e5));
    /* normal of facet 3 times edge 2, which is the third row of w: minus six times the volume */
    wx = _mm256_mul_pd(nx, _mm256_permute4x64_pd(wx, 0xaa));
    wy = _mm256_mul_pd(ny, _mm256_permute4x64_pd(wy, 0xaa));
    wz = _mm256_mul_pd(nz, _mm256_permute4x64_pd(wz, 0xaa));
    _mm256_storeu_pd(det, _mm256_add_pd(_mm256_add_pd(wx, wy), wz));
    longest = spr__max(spr__max(length2[0], length2[1]), spr__max(length2[2], length2[3]));
    longest = spr__max(longest, last[0] + last[1] + last[2]);
    below = (area[0] + area[1] + area[2] + area[3]) *
            _mm_cvtsd_f64(_mm_sqrt_pd(_mm_set1_pd(longest)));
    return below > 0 ? SPR__SQRT24 * -det[3] / below : 0;
}
#endif

/* NaN counts as inverted. */
static double spr__number(double value)
{
    return value == value ? value : -1;
}

static double spr__users(const spr__state *s, const double *a, const double *b, const double *c,
                         const double *d)
{
    return spr__number(s->quality(s->quality_user, a, b, c, d));
}

static double spr__quality(const spr__state *s, const double *a, const double *b, const double *c,
                           const double *d)
{
#if defined(SPR__TARGET)
    if (s->gamma && s->simd) return spr__gamma_avx2(a, b, c, d);
    if (s->rounding && s->simd) {
        double gamma = spr__gamma_avx2(a, b, c, d);
        if (gamma > s->target + SPR__ROUND) return gamma;
    }
#endif
    return s->gamma ? spr_gamma(a, b, c, d) : spr__users(s, a, b, c, d);
}

/* Quality of the tetrahedron formed by a triangle and an apex. */
static double spr__quality_on(const spr__state *s, const uint32_t *v3, const double *apex)
{
    const delaunay_mesh *m = s->mesh;
    return spr__quality(s, spr__point(m, v3[0]), spr__point(m, v3[1]), spr__point(m, v3[2]), apex);
}

static double spr__quality_of(const spr__state *s, const uint32_t *v)
{
    const delaunay_mesh *m = s->mesh;
    return spr__quality(s, spr__point(m, v[0]), spr__point(m, v[1]), spr__point(m, v[2]),
                        spr__point(m, v[3]));
}

/* What the worst quality must exceed after a change: the target, or the quality before plus a least
 * gain, without which small gains would go on for long. For a very low quality the least gain is a
 * part of it. */
static double spr__floor(const spr__state *s, double before)
{
    double least = s->sweep == SPR__SMOOTH ? 0.02 : 0.005,
           gain = spr__min(least, 0.25 * fabs(before) + 1e-12), floor_ = before + gain;
    return before < s->target && floor_ > s->target ? s->target : floor_;
}

/* A factor beyond rounding errors. */
#define SPR__MORE (1 + 1e-9)
/* A bad tetrahedron weighs 1 .. 29: with lack = 1 - quality / target, 1 + SPR__SQUARE * lack^2 +
 * SPR__SIXTEENTH * lack^16. Several better ones in the place of one that is nearly flat weigh less
 * than it. */
#define SPR__SQUARE 8
#define SPR__SIXTEENTH 20
/* Bad tetrahedra weigh clearly less if their weight falls below this part of what it was. */
#define SPR__LIGHTER 0.97
/* Thinning may lower the worst quality around a vertex to this part of what it was. */
#define SPR__THINNED 0.6
/* Nearly flat: below this part of the quality that is worth trying for. */
#define SPR__FLAT   0.1
#define SPR__NIL    1e-4 /* nil, as good as flat: below this part of the target */
#define SPR__SAVED  1000 /* a nil one may become many that are not nil, or better by this factor */
#define SPR__LIFTED 2 /* the very worst may become many that are better by this factor */

/* The bad tetrahedra of a set: their number and their total weight (spr__weight). */
typedef struct spr__burden {
    int    num;
    double weight;
} spr__burden;

static double spr__weight(const spr__state *s, double value)
{
    double lack = 1 - value / s->target, square = lack * lack, eighth = square * square;
    eighth *= eighth;
    return 1 + SPR__SQUARE * square + SPR__SIXTEENTH * eighth * eighth;
}

static void spr__burden_add(const spr__state *s, spr__burden *b, double value)
{
    if (!(value < s->target)) return;
    b->num++;
    b->weight += spr__weight(s, value);
}

static spr__burden spr__burden_of(const spr__state *s, const delaunay_handle *t, size_t n)
{
    spr__burden b = {0, 0};
    size_t i;
    for (i = 0; i < n; i++) spr__burden_add(s, &b, s->value[t[i]]);
    return b;
}

/* How many bad tetrahedra a change may add. With lift these are more if the worst of the mesh,
 * which are worse than the surface requires, become much better, or if a nil one becomes better. */
static int spr__may_add(const spr__state *s, double before, double after)
{
    const double nil = SPR__NIL * s->target;
    if (s->lift && before < nil && after > spr__min(nil, SPR__SAVED * before)) return s->nil_adds;
    if (s->lift && before < s->held && after > SPR__LIFTED * before) return s->lift_adds;
    return s->is_lifting && before >= SPR__FLAT * s->target ? 0 : s->may_add;
}

/* Whether a change is to be made, by the worst quality and the burden before and after it. Each
 * change lessens the burden or raises the worst quality, so that none is made again and again. */
static int spr__is_gain(const spr__state *s, double before, double after, spr__burden was,
                        spr__burden is)
{
    if (is.num > was.num + spr__may_add(s, before, after)) return 0;
    if (!s->tidy && !s->lift && is.weight > SPR__MORE * was.weight) return 0;
    return after > spr__floor(s, before) || (s->tidy && after > before && is.num < was.num);
}

/* -- a cone: triangles that are to be joined to an apex */

enum {
    SPR__AHEAD = 4,       /* distance of prefetching, in items */
    SPR__MAX_STAR = 200,  /* tetrahedra of a star, facets of a cone */
    SPR__MAX_HUB = 2000,  /* tetrahedra of a star whose vertex is only contracted */
    SPR__MAX_RING = 10,   /* tetrahedra around an edge that is removed */
    SPR__WIDE_RING = 32,  /* around one that gets a new vertex while lifting */
    SPR__MAX_ACTIVE = 12, /* gradients of the worst facets that smoothing takes into account */
    SPR__MAX_CAVITY = 60  /* tetrahedra that a new vertex replaces */
};

/* A triangle of a cone: with its apex p, (a,b,c,p) is to be positive. */
typedef struct spr__facet {
    const double *a, *b, *c;
    double normal[3], area, longest; /* area: doubled; longest edge: squared */
} spr__facet;

/* Four facets: their corners' coordinates by axis. */
typedef struct spr__facet4 {
    double a[3][4], b[3][4], c[3][4], normal[3][4], area[4], longest[4];
    const double *corner[4][3];
} spr__facet4;

/* n facets in groups of four; the last group is filled up with copies of the last facet. */
typedef struct spr__cone {
    size_t      n;
    spr__facet4 f[(SPR__MAX_STAR + 3) / 4];
} spr__cone;

static void spr__facet_set(spr__facet *f, const double *a, const double *b, const double *c)
{
    double ab[3], bc[3], ca[3];
    spr__sub(b, a, ab);
    spr__sub(c, b, bc);
    spr__sub(a, c, ca);
    f->a = a;
    f->b = b;
    f->c = c;
    spr__cross(ab, bc, f->normal);
    f->area = sqrt(spr__dot(f->normal, f->normal));
    f->longest = spr__max(spr__dot(ab, ab), spr__max(spr__dot(bc, bc), spr__dot(ca, ca)));
}

/* Gamma of the facet with apex p, which is K det / (longest * areas), and its gradient with respect
 * to p unless that is NULL. */
static double spr__facet_gamma(const spr__facet *f, const double *p, double *gradient)
{
    double u[3][3], e[3][3], n[3][3], r[3], l2[3], det, sum = f->area, longest = f->longest, l, k;
    int i, j, distant = -1;
    spr__sub(p, f->a, u[0]);
    spr__sub(p, f->b, u[1]);
    spr__sub(p, f->c, u[2]);
    spr__sub(f->b, f->a, e[0]);
    spr__sub(f->c, f->b, e[1]);
    spr__sub(f->a, f->c, e[2]);
    det = spr__dot(f->normal, u[0]);
    for (i = 0; i < 3; i++) {
        spr__cross(e[i], u[i], n[i]);
        r[i] = sqrt(spr__dot(n[i], n[i]));
        sum += r[i];
        l2[i] = spr__dot(u[i], u[i]);
        if (l2[i] > longest) {
            longest = l2[i];
            distant = i;
        }
    }
    l = sqrt(longest);
    if (!(l * sum > 0)) {
        if (gradient) gradient[0] = gradient[1] = gradient[2] = 0;
        return 0;
    }
    k = SPR__SQRT24 / (l * sum);
    if (gradient) {
        double grow[3] = {0, 0, 0}, g[3], per_sum = 1 / sum, per_longest = 1 / longest;
        for (i = 0; i < 3; i++)
            if (r[i] > 0) {
                double per_r = 1 / r[i];
                spr__cross(n[i], e[i], g);
                for (j = 0; j < 3; j++) grow[j] += g[j] * per_r;
            }
        for (j = 0; j < 3; j++)
            gradient[j] =
                k * (f->normal[j] - det * (grow[j] * per_sum +
                                           (distant >= 0 ? u[distant][j] * per_longest : 0)));
    }
    return k * det;
}

static double spr__facet_value(const spr__state *s, const spr__facet *f, const double *p)
{
    return s->gamma ? spr__facet_gamma(f, p, NULL) : spr__users(s, f->a, f->b, f->c, p);
}

/* Facet i of a group of four. */
static void spr__facet_of_four(spr__facet *f, const spr__facet4 *four, int i)
{
    int k;
    f->a = four->corner[i][0];
    f->b = four->corner[i][1];
    f->c = four->corner[i][2];
    for (k = 0; k < 3; k++) f->normal[k] = four->normal[k][i];
    f->area = four->area[i];
    f->longest = four->longest[i];
}

static void spr__facet4_set(spr__facet4 *four)
{
    spr__facet f;
    int i, k;
    for (i = 0; i < 4; i++) {
        spr__facet_set(&f, four->corner[i][0], four->corner[i][1], four->corner[i][2]);
        for (k = 0; k < 3; k++) {
            four->a[k][i] = f.a[k];
            four->b[k][i] = f.b[k];
            four->c[k][i] = f.c[k];
            four->normal[k][i] = f.normal[k];
        }
        four->area[i] = f.area;
        four->longest[i] = f.longest;
    }
}

static void spr__facet4_gradient(const spr__facet4 *four, const double *p, double *value,
                                 double (*gradient)[4])
{
    spr__facet f;
    double g[3];
    int i, k;
    for (i = 0; i < 4; i++) {
        spr__facet_of_four(&f, four, i);
        value[i] = spr__facet_gamma(&f, p, g);
        for (k = 0; k < 3; k++) gradient[k][i] = g[k];
    }
}

#if defined(SPR__TARGET)
/* Four vectors in space. */
typedef struct spr__v3 {
    __m256d x, y, z;
} spr__v3;

SPR__TARGET DELAUNAY_INLINE __m256d spr__dot4(spr__v3 a, spr__v3 b)
{
    return _mm256_add_pd(_mm256_add_pd(_mm256_mul_pd(a.x, b.x), _mm256_mul_pd(a.y, b.y)),
                         _mm256_mul_pd(a.z, b.z));
}
SPR__TARGET DELAUNAY_INLINE spr__v3 spr__sub4(spr__v3 a, spr__v3 b)
{
    spr__v3 d;
    d.x = _mm256_sub_pd(a.x, b.x);
    d.y = _mm256_sub_pd(a.y, b.y);
    d.z = _mm256_sub_pd(a.z, b.z);
    return d;
}
SPR__TARGET DELAUNAY_INLINE spr__v3 spr__cross4(spr__v3 a, spr__v3 b)
{
    spr__v3 c;
    c.x = _mm256_sub_pd(_mm256_mul_pd(a.y, b.z), _mm256_mul_pd(a.z, b.y));
    c.y = _mm256_sub_pd(_mm256_mul_pd(a.z, b.x), _mm256_mul_pd(a.x, b.z));
    c.z = _mm256_sub_pd(_mm256_mul_pd(a.x, b.y), _mm256_mul_pd(a.y, b.x));
    return c;
}
SPR__TARGET DELAUNAY_INLINE spr__v3 spr__load4(const double (*p)[4])
{
    spr__v3 v;
    v.x = _mm256_loadu_pd(p[0]);
    v.y = _mm256_loadu_pd(p[1]);
    v.z = _mm256_loadu_pd(p[2]);
    return v;
}
SPR__TARGET DELAUNAY_INLINE void spr__store4(double (*p)[4], spr__v3 v)
{
    _mm256_storeu_pd(p[0], v.x);
    _mm256_storeu_pd(p[1], v.y);
    _mm256_storeu_pd(p[2], v.z);
}
SPR__TARGET DELAUNAY_INLINE spr__v3 spr__same4(const double *p)
{
    spr__v3 v;
    v.x = _mm256_set1_pd(p[0]);
    v.y = _mm256_set1_pd(p[1]);
    v.z = _mm256_set1_pd(p[2]);
    return v;
}
/* Four vertices of a mesh: 32 bytes, the size of each, are read. */
SPR__TARGET DELAUNAY_INLINE spr__v3 spr__gather4(const double *p0, const double *p1,
                                                 const double *p2, const double *p3)
{
    spr__v3 v;
    spr__columns(_mm256_loadu_pd(p0), _mm256_loadu_pd(p1), _mm256_loadu_pd(p2),
                 _mm256_loadu_pd(p3), &v.x, &v.y, &v.z);
    return v;
}
SPR__TARGET DELAUNAY_INLINE __m256d spr__greatest4(__m256d a, __m256d b, __m256d c)
{
    return _mm256_max_pd(a, _mm256_max_pd(b, c));
}

/* Sets four facets by their corners. */
SPR__TARGET DELAUNAY_INLINE void spr__facet4_of(spr__facet4 *f, spr__v3 a, spr__v3 b, spr__v3 c)
{
    spr__v3 ab = spr__sub4(b, a), bc = spr__sub4(c, b), ca = spr__sub4(a, c),
            normal = spr__cross4(ab, bc);
    spr__store4(f->a, a);
    spr__store4(f->b, b);
    spr__store4(f->c, c);
    spr__store4(f->normal, normal);
    _mm256_storeu_pd(f->area, _mm256_sqrt_pd(spr__dot4(normal, normal)));
    _mm256_storeu_pd(f->longest, spr__greatest4(spr__dot4(ab, ab), spr__dot4(bc, bc),
                                                spr__dot4(ca, ca)));
}

SPR__TARGET static void spr__facet4_set_avx2(spr__facet4 *f)
{
    spr__facet4_of(
        f, spr__gather4(f->corner[0][0], f->corner[1][0], f->corner[2][0], f->corner[3][0]),
        spr__gather4(f->corner[0][1], f->corner[1][1], f->corner[2][1], f->corner[3][1]),
        spr__gather4(f->corner[0][2], f->corner[1][2], f->corner[2][2], f->corner[3][2]));
}

/* spr__facet_gamma of four facets; gradient: NULL, or three rows. */
SPR__TARGET DELAUNAY_INLINE __m256d spr__gamma4(const spr__facet4 *f, spr__v3 p,
                                                double (*gradient)[4])
{
    spr__v3 a = spr__load4(f->a), b = spr__load4(f->b), c = spr__load4(f->c),
            normal = spr__load4(f->normal), e[3], u[3], n[3], distant;
    __m256d zero = _mm256_setzero_pd(), sum = _mm256_loadu_pd(f->area),
            longest = _mm256_loadu_pd(f->longest), r[3], det, below, l2, more, k, some;
    int i;
    u[0] = spr__sub4(p, a);
    u[1] = spr__sub4(p, b);
    u[2] = spr__sub4(p, c);
    e[0] = spr__sub4(b, a);
    e[1] = spr__sub4(c, b);
    e[2] = spr__sub4(a, c);
    det = spr__dot4(normal, u[0]);
    distant.x = distant.y = distant.z = zero;
    for (i = 0; i < 3; i++) {
        n[i] = spr__cross4(e[i], u[i]);
        r[i] = _mm256_sqrt_pd(spr__dot4(n[i], n[i]));
        sum = _mm256_add_pd(sum, r[i]);
        l2 = spr__dot4(u[i], u[i]);
        more = _mm256_cmp_pd(l2, longest, _CMP_GT_OQ);
        longest = _mm256_blendv_pd(longest, l2, more);
        distant.x = _mm256_blendv_pd(distant.x, u[i].x, more);
        distant.y = _mm256_blendv_pd(distant.y, u[i].y, more);
        distant.z = _mm256_blendv_pd(distant.z, u[i].z, more);
    }
    below = _mm256_mul_pd(_mm256_sqrt_pd(longest), sum);
    some = _mm256_cmp_pd(below, zero, _CMP_GT_OQ);
    k = _mm256_and_pd(_mm256_div_pd(_mm256_set1_pd(SPR__SQRT24), below), some);
    if (gradient) {
        __m256d one = _mm256_set1_pd(1), per_sum = _mm256_div_pd(one, sum),
                per_longest = _mm256_div_pd(one, longest);
        spr__v3 grow;
        grow.x = grow.y = grow.z = zero;
        for (i = 0; i < 3; i++) {
            spr__v3 g = spr__cross4(n[i], e[i]);
            __m256d per_r = _mm256_div_pd(one, r[i]), is = _mm256_cmp_pd(r[i], zero, _CMP_GT_OQ);
            grow.x = _mm256_add_pd(grow.x, _mm256_and_pd(_mm256_mul_pd(g.x, per_r), is));
            grow.y = _mm256_add_pd(grow.y, _mm256_and_pd(_mm256_mul_pd(g.y, per_r), is));
            grow.z = _mm256_add_pd(grow.z, _mm256_and_pd(_mm256_mul_pd(g.z, per_r), is));
        }
#  define SPR__GRADIENT(row, axis)                                                                \
      _mm256_storeu_pd(                                                                           \
          gradient[row],                                                                          \
          _mm256_and_pd(some, _mm256_mul_pd(k, _mm256_sub_pd(normal.axis,                         \
              _mm256_mul_pd(det, _mm256_add_pd(_mm256_mul_pd(grow.axis, per_sum),                 \
                                               _mm256_mul_pd(distant.axis, per_longest)))))))
        SPR__GRADIENT(0, x);
        SPR__GRADIENT(1, y);
        SPR__GRADIENT(2, z);
    }
    return _mm256_and_pd(_mm256_mul_pd(k, det), some);
}

SPR__TARGET static void spr__facet4_gradient_avx2(const spr__facet4 *f, const double *p,
                                                  double *value, double (*gradient)[4])
{
    _mm256_storeu_pd(value, spr__gamma4(f, spr__same4(p), gradient));
}

/* spr__shape of four tetrahedra; area: lengths of the normals; area2: their squares. */
typedef struct spr__shape4 {
    spr__v3 normal[4];
    __m256d length2[6], area[4], area2[4], det;
} spr__shape4;

SPR__TARGET DELAUNAY_INLINE void spr__shape4_set(spr__shape4 *s, spr__v3 a, spr__v3 b, spr__v3 c,
                                                 spr__v3 d)
{
    spr__v3 e[6];
    int i;
    e[0] = spr__sub4(b, a);
    e[1] = spr__sub4(c, a);
    e[2] = spr__sub4(d, a);
    e[3] = spr__sub4(c, b);
    e[4] = spr__sub4(d, b);
    e[5] = spr__sub4(d, c);
    s->normal[0] = spr__cross4(e[3], e[4]);
    s->normal[1] = spr__cross4(e[2], e[1]);
    s->normal[2] = spr__cross4(e[0], e[2]);
    s->normal[3] = spr__cross4(e[1], e[0]);
    s->det = _mm256_xor_pd(spr__dot4(s->normal[3], e[2]), _mm256_set1_pd(-0.0));
    for (i = 0; i < 6; i++) s->length2[i] = spr__dot4(e[i], e[i]);
    for (i = 0; i < 4; i++) {
        s->area2[i] = spr__dot4(s->normal[i], s->normal[i]);
        s->area[i] = _mm256_sqrt_pd(s->area2[i]);
    }
}

/* a / b, or 0 where b is not positive. */
SPR__TARGET DELAUNAY_INLINE __m256d spr__ratio4(__m256d a, __m256d b)
{
    __m256d some = _mm256_cmp_pd(b, _mm256_setzero_pd(), _CMP_GT_OQ);
    return _mm256_and_pd(_mm256_div_pd(a, b), some);
}

SPR__TARGET DELAUNAY_INLINE __m256d spr__shape4_gamma(const spr__shape4 *s)
{
    __m256d area = s->area[0], longest = s->length2[0];
    int i;
    for (i = 1; i < 4; i++) area = _mm256_add_pd(area, s->area[i]);
    for (i = 1; i < 6; i++) longest = _mm256_max_pd(longest, s->length2[i]);
    return spr__ratio4(_mm256_mul_pd(_mm256_set1_pd(SPR__SQRT24), s->det),
                       _mm256_mul_pd(area, _mm256_sqrt_pd(longest)));
}

SPR__TARGET DELAUNAY_INLINE __m256d spr__shape4_sicn(const spr__shape4 *s)
{
    __m256d area2 = s->area2[0], length2 = s->length2[0];
    int i;
    for (i = 1; i < 4; i++) area2 = _mm256_add_pd(area2, s->area2[i]);
    for (i = 1; i < 6; i++) length2 = _mm256_add_pd(length2, s->length2[i]);
    return spr__ratio4(_mm256_mul_pd(_mm256_set1_pd(6), s->det),
                       _mm256_mul_pd(_mm256_sqrt_pd(area2), _mm256_sqrt_pd(length2)));
}

SPR__TARGET DELAUNAY_INLINE void spr__shape4_extremes(const spr__shape4 *s, __m256d *out)
{
    int i;
    out[0] = out[1] = _mm256_set1_pd(4);
    for (i = 0; i < 6; i++) {
        const uint8_t *facets = delaunay_edge_order(5 - i); /* beside edge i */
        int f = facets[0], g = facets[1];
        __m256d sine = spr__ratio4(_mm256_mul_pd(s->det, _mm256_sqrt_pd(s->length2[i])),
                                   _mm256_mul_pd(s->area[f], s->area[g])),
                acute = _mm256_cmp_pd(spr__dot4(s->normal[f], s->normal[g]),
                                       _mm256_setzero_pd(), _CMP_LT_OQ),
                little = _mm256_min_pd(out[0], _mm256_mul_pd(sine, _mm256_set1_pd(3.5))),
                large = _mm256_min_pd(out[1], _mm256_mul_pd(sine, _mm256_set1_pd(1.8)));
        out[0] = _mm256_blendv_pd(out[0], little, acute);
        out[1] = _mm256_blendv_pd(large, out[1], acute);
    }
    out[2] = _mm256_mul_pd(spr__shape4_sicn(s), _mm256_set1_pd(2.4));
}

/* spr__measure_all of four facets with apex p. */
SPR__TARGET DELAUNAY_INLINE __m256d spr__all4(const spr__facet4 *f, spr__v3 p,
                                              const spr__focus *focus)
{
    spr__shape4 s;
    __m256d gamma, all, e[3], plain;
    int k;
    spr__shape4_set(&s, spr__load4(f->a), spr__load4(f->b), spr__load4(f->c), p);
    plain = gamma = spr__shape4_gamma(&s);
    spr__shape4_extremes(&s, e);
    for (k = 0; k < 3; k++) e[k] = _mm256_add_pd(e[k], _mm256_set1_pd(focus->spare[k]));
    if (focus->lift > 0) {
        __m256d lift = _mm256_set1_pd(focus->lift),
                more = _mm256_mul_pd(gamma, _mm256_set1_pd(focus->lift / focus->low));
        gamma = _mm256_max_pd(gamma, _mm256_min_pd(more, lift));
    }
    all = _mm256_mul_pd(_mm256_set1_pd(focus->target),
                        _mm256_min_pd(e[0], _mm256_min_pd(e[1], e[2])));
    return _mm256_blendv_pd(
        _mm256_min_pd(gamma, all), plain,
        _mm256_cmp_pd(plain, _mm256_set1_pd(focus->target + SPR__ROUND), _CMP_GT_OQ));
}

/* spr__extremes of four tetrahedra, by their corners; a row for each measure. */
SPR__TARGET static void spr__points4_extremes_avx2(const double *(*p)[4], double (*out)[4])
{
    spr__v3 v[4];
    spr__shape4 s;
    __m256d e[3];
    int i;
    for (i = 0; i < 4; i++) v[i] = spr__gather4(p[0][i], p[1][i], p[2][i], p[3][i]);
    spr__shape4_set(&s, v[0], v[1], v[2], v[3]);
    spr__shape4_extremes(&s, e);
    for (i = 0; i < 3; i++) _mm256_storeu_pd(out[i], e[i]);
}

SPR__TARGET static void spr__facet4_all_avx2(const spr__facet4 *f, const double *p,
                                             const spr__focus *focus, double *out)
{
    _mm256_storeu_pd(out, spr__all4(f, spr__same4(p), focus));
}

SPR__TARGET static size_t spr__cone_gammas_avx2(const spr__cone *cone, const double *p,
                                                double floor_, double *out)
{
    spr__v3 q = spr__same4(p);
    __m256d least = _mm256_set1_pd(floor_);
    size_t i;
    for (i = 0; i < cone->n; i += 4) {
        __m256d value = spr__gamma4(&cone->f[i / 4], q, NULL);
        _mm256_storeu_pd(out + i, value);
        if (_mm256_movemask_pd(_mm256_cmp_pd(value, least, _CMP_LE_OQ))) return i + 4;
    }
    return i;
}
#endif

static void spr__cone_add(spr__cone *cone, const double *a, const double *b, const double *c)
{
    const double **corner = cone->f[cone->n / 4].corner[cone->n % 4];
    cone->n++;
    corner[0] = a;
    corner[1] = b;
    corner[2] = c;
}

/* Completes a cone after the last spr__cone_add. */
static void spr__cone_close(const spr__state *s, spr__cone *cone)
{
    size_t i;
    for (i = cone->n; i % 4 != 0; i++)
        memcpy(cone->f[i / 4].corner[i % 4], cone->f[i / 4].corner[i % 4 - 1],
               sizeof cone->f[0].corner[0]);
    for (i = 0; i < cone->n; i += 4) {
#if defined(SPR__TARGET)
        if (s->simd) {
            spr__facet4_set_avx2(&cone->f[i / 4]);
            continue;
        }
#endif
        (void)s;
        spr__facet4_set(&cone->f[i / 4]);
    }
}

static const double **spr__cone_corners(const spr__cone *cone, size_t i)
{
    return (const double **)(uintptr_t)cone->f[i / 4].corner[i % 4];
}

/* Qualities, with apex p, of the four facets from number i on. */
static void spr__cone_four(const spr__state *s, const spr__cone *cone, size_t i, const double *p,
                           double *out)
{
    size_t k;
    spr__facet f;
#if defined(SPR__TARGET)
    if (s->rounding && s->simd) {
        spr__facet4_all_avx2(&cone->f[i / 4], p, &s->focus, out);
        return;
    }
#endif
    for (k = 0; k < 4; k++) {
        if (s->gamma) {
            spr__facet_of_four(&f, &cone->f[i / 4], (int)k);
            out[k] = spr__facet_gamma(&f, p, NULL);
        } else if (i + k < cone->n) {
            const double **v = spr__cone_corners(cone, i + k);
            out[k] = spr__users(s, v[0], v[1], v[2], p);
        } else out[k] = out[k - 1];
    }
}

/* Qualities with apex p, in groups of four, up to the first group in which one is not above floor_.
 * Returns how many were computed, a multiple of four: out has room for SPR__MAX_STAR + 4. */
static size_t spr__cone_values(const spr__state *s, const spr__cone *cone, const double *p,
                               double floor_, double *out)
{
    size_t i;
#if defined(SPR__TARGET)
    if (s->gamma && s->simd) return spr__cone_gammas_avx2(cone, p, floor_, out);
#endif
    for (i = 0; i < cone->n; i += 4) {
        spr__cone_four(s, cone, i, p, out + i);
        if (out[i] <= floor_ || out[i + 1] <= floor_ || out[i + 2] <= floor_ ||
            out[i + 3] <= floor_)
            return i + 4;
    }
    return i;
}

/* Gradients with respect to p of the qualities of the four facets from number i on. */
static void spr__cone_gradients(const spr__state *s, const spr__cone *cone, size_t i,
                                const double *p, double (*gradient)[3])
{
    double value[4], g[3][4];
    size_t k;
    int j;
    if (!s->gamma) { /* finite differences */
        double h = 1e-5 * sqrt(cone->f[i / 4].longest[0]), q[3], there[4];
        spr__cone_four(s, cone, i, p, value);
        for (j = 0; j < 3; j++) {
            memcpy(q, p, sizeof q);
            q[j] += h;
            spr__cone_four(s, cone, i, q, there);
            for (k = 0; k < 4; k++) gradient[k][j] = (there[k] - value[k]) / h;
        }
        return;
    }
#if defined(SPR__TARGET)
    if (s->simd) spr__facet4_gradient_avx2(&cone->f[i / 4], p, value, g);
    else
#endif
        spr__facet4_gradient(&cone->f[i / 4], p, value, g);
    for (k = 0; k < 4; k++)
        for (j = 0; j < 3; j++) gradient[k][j] = g[j][k];
}

/* The worst quality of a cone with apex p; if one is not above floor_, any such value. */
static double spr__cone_value(const spr__state *s, const spr__cone *cone, const double *p,
                              double floor_)
{
    double q[SPR__MAX_STAR + 4], worst = HUGE_VAL;
    size_t n = spr__cone_values(s, cone, p, floor_, q), i;
    for (i = 0; i < n; i++) worst = spr__min(worst, q[i]);
    return worst;
}

static spr__burden spr__cone_burden(const spr__state *s, const spr__cone *cone, const double *p)
{
    double q[SPR__MAX_STAR + 4];
    spr__burden b = {0, 0};
    size_t i;
    spr__cone_values(s, cone, p, -HUGE_VAL, q);
    for (i = 0; i < cone->n; i++) spr__burden_add(s, &b, q[i]);
    return b;
}

static int spr__cone_is_positive(const spr__cone *cone, const double *p)
{
    size_t i;
    for (i = 0; i < cone->n; i++) {
        const double **v = spr__cone_corners(cone, i);
        if (delaunay_orient3d(v[0], v[1], v[2], p) <= 0) return 0;
    }
    return 1;
}

/* The link of v as a cone. Returns 0 if it is too large. */
static int spr__cone_of_star(const spr__state *s, spr__cone *cone, uint32_t v,
                             const delaunay_list *star)
{
    const delaunay_mesh *m = s->mesh;
    size_t i;
    if (star->count > SPR__MAX_STAR) return 0;
    for (cone->n = i = 0; i < star->count; i++) {
        uint32_t b[3];
        spr__base_of(m, star->items[i], v, b);
        spr__cone_add(cone, spr__point(m, b[0]), spr__point(m, b[1]), spr__point(m, b[2]));
    }
    spr__cone_close(s, cone);
    return 1;
}

#if defined(SPR__TARGET)
/* The qualities of n tetrahedra on facet abc, four at a time. */
SPR__TARGET static void spr__apex_qualities_avx2(const spr__state *s, const double *a,
                                                 const double *b, const double *c, size_t n,
                                                 const double *apices, double *out)
{
    spr__facet4 four;
    spr__v3 p;
    size_t i;
    spr__facet4_of(&four, spr__same4(a), spr__same4(b), spr__same4(c));
    for (i = 0; i < n; i += 4) {
        p.x = _mm256_loadu_pd(apices + i);
        p.y = _mm256_loadu_pd(apices + i + DELAUNAY_WINDOW_VERTICES);
        p.z = _mm256_loadu_pd(apices + i + 2 * DELAUNAY_WINDOW_VERTICES);
        _mm256_storeu_pd(out + i, s->gamma ? spr__gamma4(&four, p, NULL)
                                           : spr__all4(&four, p, &s->focus));
    }
}
#endif

/* delaunay_search.qualities: those of n tetrahedra on facet abc. A function of the caller is called
 * for each. */
static void spr__search_qualities(void *user, const double *a, const double *b, const double *c,
                                  size_t n, const double *apices, double *out)
{
    const spr__state *s = (const spr__state *)user;
    spr__facet f;
    size_t i;
#if defined(SPR__TARGET)
    if (s->simd && (s->gamma || s->rounding)) {
        spr__apex_qualities_avx2(s, a, b, c, n, apices, out);
        return;
    }
#endif
    spr__facet_set(&f, a, b, c);
    for (i = 0; i < n; i++) {
        double p[3];
        int k;
        for (k = 0; k < 3; k++) p[k] = apices[i + (size_t)k * DELAUNAY_WINDOW_VERTICES];
        out[i] = spr__facet_value(s, &f, p);
    }
}

/* -- bounds: how good a tetrahedron on a facet of the surface can be */

/* An apex must lie on the inner side of n planes: those of the surface facets that meet the facet
 * at less than 180 degrees. */
typedef struct spr__wedge {
    int    n;
    int    rough; /* the search for an apex does not go along the planes: for the schedule, which
                   * does better if it leaves out those that hardly have a better one */
    double point[3][3], normal[3][3];
} spr__wedge;

static int spr__wedge_has(const spr__wedge *w, const double *p)
{
    double u[3];
    int i;
    for (i = 0; i < w->n; i++) {
        spr__sub(p, w->point[i], u);
        if (spr__dot(u, w->normal[i]) < 0) return 0;
    }
    return 1;
}

/* Moves p into the wedge, by the shortest way or nearly so. Returns 0 if that fails, or if p is not
 * in a rough one. */
static int spr__wedge_clamp(const spr__wedge *w, double *p)
{
    enum { SPR__TURNS = 10 };
    double u[3], depth;
    int turn, i, k, moved = 1;
    if (w && w->rough) return spr__wedge_has(w, p);
    for (turn = 0; w && moved && turn < SPR__TURNS; turn++)
        for (moved = i = 0; i < w->n; i++) {
            spr__sub(p, w->point[i], u);
            depth = spr__dot(u, w->normal[i]);
            if (depth >= 0) continue;
            depth *= (1 + 1e-9) / spr__dot(w->normal[i], w->normal[i]);
            for (k = 0; k < 3; k++) p[k] -= depth * w->normal[i][k];
            moved = 1;
        }
    return !w || !moved;
}

/* Pattern search from p, which is in the wedge, for the best apex; ends early at a quality that is
 * enough. Returns its quality. */
static double spr__best_apex(const spr__state *s, const spr__facet *f, const spr__wedge *w,
                             double *p, double enough)
{
    enum { SPR__WAYS = 14 };
    static const signed char way[3][SPR__WAYS] = {{1, -1, 0, 0, 0, 0, 1, -1, 1, -1, 1, -1, -1, 1},
                                             {0, 0, 1, -1, 0, 0, 1, -1, -1, 1, 1, -1, 1, -1},
                                             {0, 0, 0, 0, 1, -1, 1, -1, 1, -1, -1, 1, 1, -1}};
    double step = 0.4 * sqrt(f->longest), least = (w && w->rough ? 2e-3 : 2e-4) * step,
           best = spr__facet_value(s, f, p);
    double apices[3 * DELAUNAY_WINDOW_VERTICES] = {0}, value[DELAUNAY_WINDOW_VERTICES], q[3];
    int i, k, n, tries, moved;
    for (tries = 0; step > least && best < enough && tries < 100; tries++) {
        for (n = i = 0; i < SPR__WAYS; i++) {
            for (k = 0; k < 3; k++) q[k] = p[k] + step * way[k][i];
            if (!spr__wedge_clamp(w, q)) continue;
            for (k = 0; k < 3; k++) apices[n + k * DELAUNAY_WINDOW_VERTICES] = q[k];
            n++;
        }
        spr__search_qualities((void *)(uintptr_t)s, f->a, f->b, f->c, (size_t)n, apices, value);
        for (moved = i = 0; i < n; i++) {
            if (!(value[i] > best)) continue;
            best = value[i];
            for (k = 0; k < 3; k++) p[k] = apices[i + k * DELAUNAY_WINDOW_VERTICES];
            moved = 1;
        }
        if (!moved) step *= 0.5;
    }
    return best;
}

/* The best quality over all apices, or any that is at least enough. here: an apex that is known to
 * be possible, or NULL. */
static double spr__facet_bound(const spr__state *s, const spr__facet *f, const spr__wedge *w,
                               const double *here, double enough)
{
    double p[3], best = 0, height = 0.6 * sqrt(f->longest);
    int k;
    for (k = 0; k < 3; k++)
        p[k] =
            (f->a[k] + f->b[k] + f->c[k]) / 3 + (f->area > 0 ? height * f->normal[k] / f->area : 0);
    if (spr__wedge_clamp(w, p)) best = spr__best_apex(s, f, w, p, enough);
    if (here && best < enough) {
        memcpy(p, here, sizeof p);
        best = spr__max(best, spr__best_apex(s, f, w, p, enough));
    }
    return best;
}

SPR_API double spr_gamma_bound(const double *a, const double *b, const double *c)
{
    spr__state s;
    spr__facet f;
    memset(&s, 0, sizeof s);
    s.gamma = 1;
    spr__facet_set(&f, a, b, c);
    return f.area > 0 ? spr__facet_bound(&s, &f, NULL, NULL, HUGE_VAL) : 0;
}

/* Whether facet i of t is a wall, which no operator crosses: constrained, on the boundary, or
 * between colours. */
static int spr__is_wall(const delaunay_mesh *m, delaunay_handle t, int i)
{
    delaunay_handle n = m->tets[t].n[i] / 4;
    return n == 0 || delaunay_is_ghost(m, n) ||
           (m->flags && (m->flags[t] & DELAUNAY_FACET_BIT(i))) ||
           (m->color && m->color[n] != m->color[t]);
}

/* The first wall met on turning around edge uv of t away from facet i of t: a facet handle, or 0 if
 * there is none. */
static delaunay_handle spr__next_wall(const delaunay_mesh *m, delaunay_handle t, int i, uint32_t u,
                                      uint32_t v)
{
    int steps, j, k;
    for (steps = 0; steps < 1000; steps++) {
        for (j = 0; j < 4; j++) /* the other facet of t at the edge */
            if (j != i && m->tets[t].v[j] != u && m->tets[t].v[j] != v) break;
        if (spr__is_wall(m, t, j)) return 4 * t + (delaunay_handle)j;
        k = (int)(m->tets[t].n[j] % 4);
        t = m->tets[t].n[j] / 4;
        i = k;
    }
    return 0;
}

/* Upper bound of the quality of a tetrahedron on wall i of t, as limited by the neighbouring walls;
 * if it is at least enough, any value from there on. rough: see spr__wedge. */
static double spr__wall_bound(const spr__state *s, delaunay_handle t, int i, double enough,
                              int rough)
{
    const delaunay_mesh *m = s->mesh;
    const uint32_t *v = m->tets[t].v;
    const uint8_t *o = delaunay_facet_order(i);
    spr__facet f, g;
    spr__wedge w;
    int e;
    w.n = 0;
    w.rough = rough;
    spr__facet_set(&f, spr__point(m, v[o[0]]), spr__point(m, v[o[2]]), spr__point(m, v[o[1]]));
    for (e = 0; e < 3; e++) {
        uint32_t a = v[o[e]], b = v[o[(e + 1) % 3]];
        delaunay_handle h = spr__next_wall(m, t, i, a, b);
        uint32_t x[3];
        int k;
        if (h == 0) continue;
        spr__base(m, h, x);
        spr__facet_set(&g, spr__point(m, x[0]), spr__point(m, x[1]), spr__point(m, x[2]));
        for (k = 0; k < 3; k++)
            if (x[k] != a && x[k] != b) break;
        if (k == 3 || delaunay_orient3d(f.a, f.b, f.c, spr__point(m, x[k])) <= 0) continue;
        memcpy(w.point[w.n], g.a, sizeof w.point[0]);
        memcpy(w.normal[w.n++], g.normal, sizeof w.normal[0]);
    }
    return spr__facet_bound(s, &f, &w, spr__point(m, v[i]), enough);
}

/* The best quality that a tetrahedron with the walls of t can have, or, if it is at least enough,
 * any value from there on; 1 without walls. rough: see spr__wedge. */
static double spr__bound(const spr__state *s, delaunay_handle t, double enough, int rough)
{
    double bound = 1;
    int i;
    for (i = 0; i < 4; i++)
        if (spr__is_wall(s->mesh, t, i))
            bound = spr__min(bound, spr__wall_bound(s, t, i, enough, rough));
    return bound;
}

/* -- statistics */

/* The k-th smallest of n values, which are reordered. */
static double spr__select(double *x, size_t n, size_t k)
{
    size_t lo = 0, hi = n - 1;
    while (lo < hi) {
        double pivot = x[lo + (hi - lo) / 2], swap;
        size_t i = lo, j = hi;
        for (;;) {
            while (x[i] < pivot) i++;
            while (x[j] > pivot) j--;
            if (i >= j) break;
            swap = x[i];
            x[i++] = x[j];
            x[j--] = swap;
        }
        if (k <= j) hi = j;
        else lo = j + 1;
    }
    return x[k];
}

/* Cosines of 10, 20, .. 170 degrees. */
static const double spr__cosine[17] = {0.984807753012208,  0.939692620785908,  0.866025403784439,
                                       0.766044443118978,  0.642787609686539,  0.5,
                                       0.342020143325669,  0.173648177666930,  0,
                                       -0.173648177666930, -0.342020143325669, -0.5,
                                       -0.642787609686539, -0.766044443118978, -0.866025403784439,
                                       -0.939692620785908, -0.984807753012208};

/* What the statistics need of four tetrahedra. */
typedef struct spr__four {
    const double *corner[4][4]; /* the corners of each */
    double        gamma[4], sicn[4], cosine[6][4];
    int64_t       tenth[6][4];  /* of each angle: how many of the cosines above exceed its own */
} spr__four;

static void spr__four_set(spr__four *four)
{
    spr__shape shape;
    double root[4];
    int i, j, k;
    for (k = 0; k < 4; k++) {
        const double **p = four->corner[k];
        spr__shape_set(&shape, p[0], p[1], p[2], p[3]);
        four->gamma[k] = spr__shape_gamma(&shape);
        four->sicn[k] = spr__shape_sicn(&shape);
        for (i = 0; i < 4; i++) root[i] = sqrt(spr__dot(shape.normal[i], shape.normal[i]));
        for (i = 0; i < 6; i++) {
            const uint8_t *f = delaunay_edge_order(i);
            double below = root[f[0]] * root[f[1]],
                   c = below > 0 ? -spr__dot(shape.normal[f[0]], shape.normal[f[1]]) / below : 1;
            four->cosine[i][k] = c;
            for (four->tenth[i][k] = j = 0; j < 17; j++) four->tenth[i][k] += c < spr__cosine[j];
        }
    }
}

#if defined(SPR__TARGET)
/* Dihedral angle i, between the facets with normals m and n; below: the product of their lengths.
 */
SPR__TARGET DELAUNAY_INLINE void spr__cosine4(spr__four *four, int i, spr__v3 m, spr__v3 n,
                                              __m256d below)
{
    __m256d some = _mm256_cmp_pd(below, _mm256_setzero_pd(), _CMP_GT_OQ), c;
    __m256i count = _mm256_setzero_si256();
    int j;
    c = _mm256_xor_pd(spr__dot4(m, n), _mm256_set1_pd(-0.0));
    c = _mm256_blendv_pd(_mm256_set1_pd(1), _mm256_div_pd(c, below), some);
    for (j = 0; j < 17; j++) {
        __m256d less = _mm256_cmp_pd(c, _mm256_set1_pd(spr__cosine[j]), _CMP_LT_OQ);
        count = _mm256_sub_epi64(count, _mm256_castpd_si256(less));
    }
    _mm256_storeu_pd(four->cosine[i], c);
    _mm256_storeu_si256((__m256i *)(void *)four->tenth[i], count);
}

SPR__TARGET static void spr__four_set_avx2(spr__four *f)
{
    spr__v3 v[4];
    spr__shape4 s;
    int i;
    for (i = 0; i < 4; i++)
        v[i] = spr__gather4(f->corner[0][i], f->corner[1][i], f->corner[2][i], f->corner[3][i]);
    spr__shape4_set(&s, v[0], v[1], v[2], v[3]);
    _mm256_storeu_pd(f->gamma, spr__shape4_gamma(&s));
    _mm256_storeu_pd(f->sicn, spr__shape4_sicn(&s));
    for (i = 0; i < 6; i++) {
        int a = delaunay_edge_order(i)[0], b = delaunay_edge_order(i)[1];
        spr__cosine4(f, i, s.normal[a], s.normal[b], _mm256_mul_pd(s.area[a], s.area[b]));
    }
}
#endif

enum {
    SPR__STATISTICS_BLOCKS = 256,
    SPR__LEAST_BLOCK = 1024, /* slots */
    SPR__FINE = 320          /* parts of [0, 1]; a multiple of 20 */
};

/* What is summed up over a block of slots. */
typedef struct spr__part {
    spr_statistics s;
    double         sum, cosine[2]; /* greatest and least */
    uint64_t       fine[SPR__FINE], inverted;
} spr__part;

static int spr__fine(double value)
{
    int k = value > 0 ? (int)((double)SPR__FINE * spr__min(value, 1)) : 0;
    return k < SPR__FINE ? k : SPR__FINE - 1;
}

/* Blocks of slots, the sums over each, and the sums over all, added in the order of the blocks: the
 * same for any number of threads. */
typedef struct spr__blocks {
    spr__part *part, all;
    size_t     slots, each;
    int        num, threads;
} spr__blocks;

static delaunay_handle spr__block_begin(const spr__blocks *blocks, int b)
{
    size_t begin = (size_t)b * blocks->each;
    return (delaunay_handle)(begin < blocks->slots ? begin : blocks->slots);
}

/* Adds the first n of four tetrahedra. */
static void spr__part_add(const spr__state *s, spr__part *part, spr__four *four,
                          const delaunay_handle *t, int n)
{
    spr_statistics *out = &part->s;
    int i, k;
    for (k = n; k < 4; k++)
        memcpy(four->corner[k], four->corner[0], sizeof four->corner[k]);
#if defined(SPR__TARGET)
    if (s->simd) spr__four_set_avx2(four);
    else
#endif
        spr__four_set(four);
    for (k = 0; k < n; k++) {
        const double **p = four->corner[k];
        double value = s->gamma ? spr__number(four->gamma[k])
                                : spr__users(s, p[0], p[1], p[2], p[3]);
        s->value[t[k]] = value;
        part->sum += value;
        part->fine[spr__fine(value)]++;
        out->num_tets++;
        out->num_below += value < s->target;
        out->min = spr__min(out->min, value);
        out->gamma_min = spr__min(out->gamma_min, four->gamma[k]);
        out->sicn_min = spr__min(out->sicn_min, four->sicn[k]);
        if (four->gamma[k] < 0) part->inverted += delaunay_orient3d(p[0], p[1], p[2], p[3]) <= 0;
        for (i = 0; i < 6; i++) {
            part->cosine[0] = spr__max(part->cosine[0], four->cosine[i][k]);
            part->cosine[1] = spr__min(part->cosine[1], four->cosine[i][k]);
            out->dihedral_histogram[four->tenth[i][k]]++;
        }
    }
}

static int spr__is_inside(const delaunay_mesh *m, delaunay_handle t)
{
    return !delaunay_is_deleted(m, t) && !delaunay_is_ghost(m, t) &&
           (!m->color || m->color[t] != DELAUNAY_OUTSIDE);
}

static void spr__part_begin(spr__part *part)
{
    memset(part, 0, sizeof *part);
    part->s.min = part->s.gamma_min = part->s.sicn_min = HUGE_VAL;
    part->cosine[0] = -1;
    part->cosine[1] = 1;
}

/* Sums up the slots first .. last-1, and sets their values: HUGE_VAL for a slot that holds no
 * tetrahedron inside the regions. */
static void spr__part_of(const spr__state *s, spr__part *part, delaunay_handle first,
                         delaunay_handle last)
{
    const delaunay_mesh *m = s->mesh;
    delaunay_handle t, of[4];
    spr__four four;
    int n = 0, k;
    spr__part_begin(part);
    for (t = first; t < last; t++) {
        if (t + SPR__AHEAD < last)
            for (k = 0; k < 4; k++) SPR__PREFETCH(&m->vertices[m->tets[t + SPR__AHEAD].v[k]]);
        s->value[t] = HUGE_VAL;
        if (t == 0 || !spr__is_inside(m, t)) continue;
        for (k = 0; k < 4; k++) four.corner[n][k] = spr__point(m, m->tets[t].v[k]);
        of[n++] = t;
        if (n < 4) continue;
        spr__part_add(s, part, &four, of, n);
        n = 0;
    }
    if (n > 0) spr__part_add(s, part, &four, of, n);
}

static void spr__part_merge(spr__part *all, const spr__part *part)
{
    spr_statistics *out = &all->s;
    int i;
    out->num_tets += part->s.num_tets;
    out->num_below += part->s.num_below;
    out->min = spr__min(out->min, part->s.min);
    out->gamma_min = spr__min(out->gamma_min, part->s.gamma_min);
    out->sicn_min = spr__min(out->sicn_min, part->s.sicn_min);
    all->sum += part->sum;
    all->inverted += part->inverted;
    all->cosine[0] = spr__max(all->cosine[0], part->cosine[0]);
    all->cosine[1] = spr__min(all->cosine[1], part->cosine[1]);
    for (i = 0; i < SPR__FINE; i++) all->fine[i] += part->fine[i];
    for (i = 0; i < 18; i++) out->dihedral_histogram[i] += part->s.dihedral_histogram[i];
}

static double spr__degrees(double cosine)
{
    return 57.29577951308232 * acos(spr__max(-1, spr__min(1, cosine)));
}

/* Writes the values of a block that are in one fine part to out. Returns their number. */
static size_t spr__values_of_part(const spr__state *s, delaunay_handle first, delaunay_handle last,
                                  int fine, double *out)
{
    const double above = fine + 1 < SPR__FINE ? (fine + 2) / (double)SPR__FINE : HUGE_VAL;
    delaunay_handle t;
    size_t n = 0;
    for (t = first; t < last; t++)
        if (s->value[t] < above && spr__fine(s->value[t]) == fine) out[n++] = s->value[t];
    return n;
}

/* The k-th smallest of all values, selected among those in its fine part. Returns 0 if out of
 * memory. */
static int spr__quantile(const spr__state *s, const spr__blocks *blocks, uint64_t k, double *out)
{
    const uint64_t *fine = blocks->all.fine;
    size_t begin[SPR__STATISTICS_BLOCKS], num[SPR__STATISTICS_BLOCKS], n = 0;
    double *values;
    int i, b;
    for (i = 0; k >= fine[i]; i++) k -= fine[i];
    values = (double *)delaunay_alloc(s->memory, (size_t)fine[i], sizeof *values);
    if (!values) return 0;
    for (b = 0; b < blocks->num; n += (size_t)blocks->part[b++].fine[i]) begin[b] = n;
    /* each thread writes the values of its blocks; the values of all are read */
    SPR__OMP(omp parallel for schedule(static) num_threads(blocks->threads))
    for (b = 0; b < blocks->num; b++)
        num[b] = spr__values_of_part(s, spr__block_begin(blocks, b),
                                     spr__block_begin(blocks, b + 1), i, values + begin[b]);
    for (n = 0, b = 0; b < blocks->num; n += num[b++]) /* without infinite values */
        memmove(values + n, values + begin[b], num[b] * sizeof *values);
    if (k < n) /* always, unless values are infinite */
        *out = spr__select(values, n, (size_t)k) + 0.0; /* no -0 */
    delaunay_release(s->memory, values);
    return 1;
}

/* Where no tetrahedron is inverted, a quality below 0 is a rounding error: of four points that are
 * nearly on a line it can be large. */
static double spr__unrounded(const spr__part *all, double quality)
{
    return quality < 0 && all->inverted == 0 ? 0 : quality;
}

/* The statistics, from the sums over all blocks. Returns 0 if out of memory. */
static int spr__summarize(const spr__state *s, const spr__blocks *blocks, spr_statistics *out)
{
    const spr__part *all = &blocks->all;
    int i;
    *out = all->s;
    for (i = 0; i < SPR__FINE; i++) out->histogram[i / (SPR__FINE / 20)] += all->fine[i];
    if (out->num_tets == 0) {
        out->min = out->gamma_min = out->sicn_min = 0;
        return 1;
    }
    out->mean = all->sum / (double)out->num_tets;
    out->dihedral_min_degrees = spr__degrees(all->cosine[0]);
    out->dihedral_max_degrees = spr__degrees(all->cosine[1]);
    if (!spr__quantile(s, blocks, out->num_tets / 100, &out->p01) ||
        !spr__quantile(s, blocks, out->num_tets / 1000, &out->p001))
        return 0;
    out->gamma_min = spr__unrounded(all, out->gamma_min);
    out->sicn_min = spr__unrounded(all, out->sicn_min);
    if (s->options.measure != SPR_USER) {
        out->min = spr__unrounded(all, out->min);
        out->p01 = spr__unrounded(all, out->p01);
        out->p001 = spr__unrounded(all, out->p001);
    }
    return 1;
}

/* Sets the values of all tetrahedra, and computes their statistics. */
static spr_result spr__statistics(const spr__state *s, spr_statistics *out)
{
    spr__blocks blocks;
    int b, ok;
    memset(out, 0, sizeof *out);
    blocks.slots = s->mesh->num_tets;
    blocks.each = blocks.slots / SPR__STATISTICS_BLOCKS + 1;
    if (blocks.each < SPR__LEAST_BLOCK) blocks.each = SPR__LEAST_BLOCK;
    blocks.num = (int)(blocks.slots / blocks.each) + 1; /* STATISTICS_BLOCKS at most */
    blocks.threads = delaunay_threads_for(&s->options.host, blocks.slots);
    blocks.part = (spr__part *)delaunay_alloc(s->memory, (size_t)blocks.num, sizeof *blocks.part);
    if (!blocks.part) return SPR_ERROR_OUT_OF_MEMORY;
    /* each thread writes its blocks' parts and their slots' values; the mesh is read */
    SPR__OMP(omp parallel for schedule(dynamic, 4) num_threads(blocks.threads))
    for (b = 0; b < blocks.num; b++)
        spr__part_of(s, &blocks.part[b], spr__block_begin(&blocks, b),
                     spr__block_begin(&blocks, b + 1));
    spr__part_begin(&blocks.all);
    for (b = 0; b < blocks.num; b++) spr__part_merge(&blocks.all, &blocks.part[b]);
    ok = spr__summarize(s, &blocks, out);
    delaunay_release(s->memory, blocks.part);
    return ok ? SPR_OK : SPR_ERROR_OUT_OF_MEMORY;
}

/* ---- >>smoothing -------------------------------------------------------------------------- */

/* Golden section search for the best worst quality on the segment from p to the mean of the facets'
 * centroids [Marot 2020, 6.1]. p and the value returned are better than before, or unchanged. */
static double spr__laplacian(const spr__state *s, const spr__cone *cone, double *p, double value)
{
    const double ratio = 0.6180339887498949;
    double way[3] = {0, 0, 0}, lo = 0, hi = 1, x[2], y[2], q[3], best = 0, best_value = value;
    int k, step;
    size_t i;
    for (i = 0; i < cone->n; i++) {
        const double **v = spr__cone_corners(cone, i);
        for (k = 0; k < 3; k++) way[k] += v[0][k] + v[1][k] + v[2][k];
    }
    for (k = 0; k < 3; k++) way[k] = way[k] / (3 * (double)cone->n) - p[k];
    x[0] = 1 - ratio;
    x[1] = ratio;
    for (step = 0; step < 2; step++) {
        for (k = 0; k < 3; k++) q[k] = p[k] + x[step] * way[k];
        y[step] = spr__cone_value(s, cone, q, value);
    }
    for (step = 0; step < 8 && (step < 2 || best_value > value); step++) {
        int left = y[0] > y[1], at = left ? 0 : 1;
        if (y[at] > best_value) {
            best_value = y[at];
            best = x[at];
        }
        if (left) hi = x[1];
        else lo = x[0];
        x[1 - at] = x[at];
        y[1 - at] = y[at];
        x[at] = left ? hi - ratio * (hi - lo) : lo + ratio * (hi - lo);
        for (k = 0; k < 3; k++) q[k] = p[k] + x[at] * way[k];
        y[at] = spr__cone_value(s, cone, q, value);
    }
    for (k = 0; k < 3; k++) p[k] += best * way[k];
    return best_value;
}

/* The shortest vector in the convex hull of n gradients; all n qualities rise along it [Freitag
 * 1995]. Returns its squared length. */
static double spr__common_ascent(double (*g)[3], int n, double *x)
{
    double d[3], t, xx, least;
    int i, k, step, at;
    memcpy(x, g[0], 3 * sizeof *x);
    for (step = 0; step < 40; step++) {
        xx = spr__dot(x, x);
        for (i = 0, at = 0, least = HUGE_VAL; i < n; i++) {
            t = spr__dot(g[i], x);
            if (t < least) {
                least = t;
                at = i;
            }
        }
        if (xx - least <= 1e-3 * xx) break;
        spr__sub(g[at], x, d);
        t = -spr__dot(x, d) / spr__dot(d, d);
        t = spr__max(0, spr__min(1, t));
        for (k = 0; k < 3; k++) x[k] += t * d[k];
    }
    return spr__dot(x, x);
}

/* Facets that are better than the worst by this much are ignored when a step is estimated. */
#define SPR__NEAR 0.2

/* Maximises the worst quality of the cone by steps along the common ascent of the worst facets,
 * each to where another facet is expected to become the worst. p and the value returned are better
 * than before, or unchanged. */
static double spr__max_min(const spr__state *s, const spr__cone *cone, double *p, double value,
                           int steps)
{
    double q[SPR__MAX_STAR + 4], g[SPR__MAX_STAR + 4][3], active[SPR__MAX_ACTIVE][3], way[3],
        here[3], rise, step, slope, v;
    int k, num, halvings;
    size_t i;
    while (steps-- > 0) {
        double worst = HUGE_VAL, band, longest;
        size_t at = 0;
        spr__cone_values(s, cone, p, -HUGE_VAL, q);
        for (i = 0; i < cone->n; i++)
            if (q[i] < worst) {
                worst = q[i];
                at = i;
            }
        longest = cone->f[at / 4].longest[at % 4];
        band = worst + 0.02;
        for (i = 0; i < cone->n; i += 4)
            if (spr__min(spr__min(q[i], q[i + 1]), spr__min(q[i + 2], q[i + 3])) <
                worst + SPR__NEAR)
                spr__cone_gradients(s, cone, i, p, g + i);
        memcpy(active[0], g[at], sizeof active[0]);
        for (num = 1, i = 0; i < cone->n && num < SPR__MAX_ACTIVE; i++)
            if (i != at && q[i] < band) memcpy(active[num++], g[i], sizeof active[0]);
        rise = spr__common_ascent(active, num, way);
        if (!(rise * longest > 1e-6)) break;
        step = 0.3 * sqrt(longest / rise);
        for (i = 0; i < cone->n; i++) {
            if (q[i] >= worst + SPR__NEAR) continue;
            slope = spr__dot(g[i], way);
            if (q[i] >= band && slope < rise)
                step = spr__min(step, (q[i] - worst) / (rise - slope));
        }
        for (v = value, halvings = 0; halvings < 6 && v <= value; halvings++, step *= 0.5) {
            for (k = 0; k < 3; k++) here[k] = p[k] + step * way[k];
            v = spr__cone_value(s, cone, here, value);
        }
        if (!(v > value)) break;
        memcpy(p, here, sizeof here);
        if (v <= value + 5e-4) return v;
        value = v;
    }
    return value;
}

/* What an operator would do: the worst quality before and after it; the vertex that moves to xyz,
 * or that is contracted to the vertex ring. */
typedef struct spr__offer {
    double   before, after;
    uint32_t vertex, ring;
    double   xyz[3];
} spr__offer;

static double spr__worst_of(const spr__state *s, const delaunay_handle *t, size_t n)
{
    double worst = HUGE_VAL;
    size_t i;
    for (i = 0; i < n; i++) worst = spr__min(worst, s->value[t[i]]);
    return worst;
}

/* Looks for a better position of v, whose star is left in plan->star. Returns 1, 0 if there is
 * none, or an error. */
static int spr__smooth(const spr__state *s, delaunay_worker *worker, uint32_t v,
                       delaunay_plan *plan, spr__offer *offer)
{
    const delaunay_mesh *m = s->mesh;
    spr__cone cone;
    delaunay_result result = delaunay_vertex_star(m, worker, v, &plan->star);
    if (result != DELAUNAY_OK) return (int)result;
    if (!spr__cone_of_star(s, &cone, v, &plan->star)) return 0;
    offer->vertex = v;
    offer->before = spr__worst_of(s, plan->star.items, plan->star.count);
    memcpy(offer->xyz, spr__point(m, v), sizeof offer->xyz);
    offer->after = spr__laplacian(s, &cone, offer->xyz, offer->before);
    if (offer->after < s->target)
        offer->after = spr__max_min(s, &cone, offer->xyz, offer->after, 8);
    if (!(offer->after > spr__floor(s, offer->before))) return 0;
    if (offer->after < s->target &&
        !spr__is_gain(s, offer->before, offer->after,
                      spr__burden_of(s, plan->star.items, plan->star.count),
                      spr__cone_burden(s, &cone, offer->xyz)))
        return 0;
    return spr__cone_is_positive(&cone, offer->xyz);
}

static void spr__swap(delaunay_list *a, delaunay_list *b)
{
    delaunay_list swap = *a;
    *a = *b;
    *b = swap;
}

/* Indices of delaunay_plan.data: what a plan tells spr__done. */
enum {
    SPR__COST = 0,    /* of large refills: twice the nodes visited; plus 1 if one is the plan */
    SPR__GOAL = 1,    /* the quality that is worth trying for, a double */
    SPR__IN_VAIN = 2, /* bit i: vertex i of the tetrahedron has no better position, or must stay;
                       * in the upper half its spr__name */
    SPR__VAIN = 3,    /* from here on: keys of cavities that were searched in vain; or 0 */
    SPR__MAX_VAIN = 5
};

/* Tells a tetrahedron from another one in the same slot. */
static uint32_t spr__name(const uint32_t *v)
{
    return ((v[0] * 0x9e3779b1u ^ v[1]) * 0x85ebca6bu ^ v[2]) * 0xc2b2ae35u ^ v[3];
}

/* Smooths the vertex of t that gains most, of those whose star has changed since they were last
 * tried in vain. */
static int spr__plan_smooth(const spr__state *s, delaunay_worker *worker, delaunay_handle t,
                            delaunay_plan *plan)
{
    spr__offer best, offer;
    int i, answer;
    best.vertex = 0;
    best.after = best.before = 0;
    for (i = 0; i < 4; i++) {
        uint32_t v = s->mesh->tets[t].v[i];
        if (!s->movable[v] || s->still[v] > s->stamp[v]) continue;
        answer = spr__smooth(s, worker, v, plan, &offer);
        if (answer < 0) return answer;
        if (answer == 0) plan->data[SPR__IN_VAIN] |= 1u << i;
        if (answer == 0 || (best.vertex && offer.after - offer.before <= best.after - best.before))
            continue;
        best = offer;
        spr__swap(&plan->star, &plan->scratch);
        if (best.after >= s->target) break;
    }
    if (!best.vertex) return DELAUNAY_PLAN_NOTHING;
    spr__swap(&plan->star, &plan->scratch);
    return delaunay_plan_move(plan, best.vertex, best.xyz, plan->star.items, plan->star.count);
}

/* -- relaxation: smoothing for the mean quality */

/* A vertex stays if it would move by less than this part of the length of the edges around it. */
#define SPR__RELAXED 0.06
#define SPR__HAIR    1e-12 /* qualities that differ by less count as equal */

enum {
    SPR__RELAX_BLOCK = 2048, /* vertices of a block, which one thread moves in order */
    SPR__RELAX_BLOCKS = 256, /* blocks between two looks at the clock */
    SPR__CURVE_DEPTH = 16
};

/* A sweep over the vertices in the order of a space-filling curve; the tetrahedra stay the same. */
typedef struct spr__sweep {
    size_t           num;    /* vertices that may move */
    uint32_t        *vertex; /* by place on the curve */
    uint32_t        *place;  /* by mesh vertex: its index in list; SPR__AT_REST: it does not
                                move, or has had its turn */
    size_t          *row;    /* by place: where its star begins; num + 1 entries */
    delaunay_handle *star;   /* the stars, one after the other */
    uint32_t        *list;   /* places of the vertices that are left, in order */
    uint8_t         *rests;  /* by index in list: it has had its turn */
    size_t           left;
} spr__sweep;

#define SPR__AT_REST UINT32_MAX

/* The way from a vertex to the mean of the facets of its cone, weighted by area. Returns 0 if it is
 * so short, as on lattices, that nothing is to be gained. */
static int spr__relax_aim(const spr__cone *cone, const double *here, double *way)
{
    double area = 0, longest = 0;
    size_t i;
    int k;
    way[0] = way[1] = way[2] = 0;
    for (i = 0; i < cone->n; i++) {
        const spr__facet4 *f = &cone->f[i / 4];
        const double **v = spr__cone_corners(cone, i);
        area += f->area[i % 4];
        longest += f->longest[i % 4];
        for (k = 0; k < 3; k++) way[k] += f->area[i % 4] * (v[0][k] + v[1][k] + v[2][k]);
    }
    if (!(area > 0)) return 0;
    for (k = 0; k < 3; k++) way[k] = way[k] / (3 * area) - here[k];
    return spr__dot(way, way) * (double)cone->n >= SPR__RELAXED * SPR__RELAXED * longest;
}

/* Sum of the qualities q, or -HUGE_VAL if one is below its lower limit in least. */
static double spr__sum_above(const double *q, const double *least, size_t n)
{
    double sum = 0;
    size_t i;
    for (i = 0; i < n; i++) {
        if (q[i] < least[i]) return -HUGE_VAL;
        sum += q[i];
    }
    return sum;
}

/* Whether a move from here to p leaves no angle extreme, or more extreme than before. after: the
 * qualities after it; tetrahedra of a high one are not looked at. */
static int spr__relax_spares_angles(const spr__state *s, const spr__cone *cone, const double *here,
                                    const double *p, const double *after)
{
    double was[3], is[3];
    size_t i;
    int k;
    for (i = 0; i < cone->n && s->gamma; i++) {
        const double **v = spr__cone_corners(cone, i);
        if (after[i] > s->target + SPR__ROUND) continue;
        spr__extremes(v[0], v[1], v[2], p, is);
        if (is[0] >= 1 && is[1] >= 1 && is[2] >= 1) continue;
        spr__extremes(v[0], v[1], v[2], here, was);
        for (k = 0; k < 3; k++)
            if (is[k] < spr__min(was[k], 1)) return 0;
    }
    return 1;
}

/* Moves v if the mean quality of its star rises, its worst does not fall (unless it stays well
 * above the target and not below the worst of the mesh), and no tetrahedron becomes bad or, if bad,
 * worse. Returns 1 if it moved. */
static int spr__relax_vertex(const spr__state *s, uint32_t v, const delaunay_list *star)
{
    spr__cone cone;
    double *here = s->mesh->vertices[v].x, way[3], p[3], least[SPR__MAX_STAR],
           after[SPR__MAX_STAR + 4], worst = s->relax_floor, before = 0, step;
    size_t i;
    int k;
    if (!spr__cone_of_star(s, &cone, v, star) || !spr__relax_aim(&cone, here, way)) return 0;
    for (i = 0; i < cone.n; i++) {
        double q = s->value[star->items[i]];
        before += q;
        least[i] = spr__min(q, s->target + 0.02);
        worst = spr__min(worst, q);
    }
    for (i = 0; i < cone.n; i++) least[i] = spr__max(least[i], worst);
    for (step = 1; step > 0.4; step *= 0.5) {
        for (k = 0; k < 3; k++) p[k] = here[k] + step * way[k];
        if (spr__cone_values(s, &cone, p, worst - SPR__HAIR, after) < cone.n ||
            !(spr__sum_above(after, least, cone.n) - before > 2e-3 * (double)cone.n) ||
            !spr__cone_is_positive(&cone, p) || !spr__relax_spares_angles(s, &cone, here, p, after))
            continue;
        memcpy(here, p, sizeof p);
        for (i = 0; i < cone.n; i++) s->value[star->items[i]] = after[i];
        return 1;
    }
    return 0;
}

/* Whether a neighbour that belongs to an earlier block may still move. */
static int spr__relax_must_wait(const spr__state *s, const spr__sweep *w, uint32_t block,
                                const delaunay_list *star)
{
    const uint32_t *v, first = block * SPR__RELAX_BLOCK;
    size_t i;
    for (i = 0; i < star->count; i++) {
        v = s->mesh->tets[star->items[i]].v;
        if (w->place[v[0]] < first || w->place[v[1]] < first || w->place[v[2]] < first ||
            w->place[v[3]] < first)
            return 1;
    }
    return 0;
}

/* One block of the current pass: moves the vertices that need not wait for others; the rest stay in
 * the list. Returns how many moved. */
static uint64_t spr__relax_block(const spr__state *s, const spr__sweep *w, size_t first)
{
    const delaunay_mesh *m = s->mesh;
    delaunay_list star;
    uint64_t moved = 0;
    size_t last = first + SPR__RELAX_BLOCK < w->left ? first + SPR__RELAX_BLOCK : w->left, i, j, k;
    memset(&star, 0, sizeof star);
    for (i = first; i < last; i++) {
        k = w->list[i];
        if (i + SPR__AHEAD < last) {
            size_t next = w->list[i + SPR__AHEAD];
            for (j = w->row[next]; j < w->row[next + 1]; j++) SPR__PREFETCH(&m->tets[w->star[j]]);
        }
        star.items = w->star + w->row[k];
        star.count = w->row[k + 1] - w->row[k];
        if (spr__relax_must_wait(s, w, (uint32_t)(first / SPR__RELAX_BLOCK), &star)) continue;
        w->rests[i] = 1;
        moved += (uint64_t)spr__relax_vertex(s, w->vertex[k], &star);
    }
    return moved;
}

/* ---- >>edge removal ----------------------------------------------------------------------- */

/* The tetrahedra around edge (a,b), their ring of vertices, and the best triangulation of the ring.
 */
typedef struct spr__ring {
    int             n;
    uint32_t        a, b, v[SPR__WIDE_RING]; /* (a, b, v[k], v[k+1]) is positive */
    delaunay_handle t[SPR__WIDE_RING];
    uint8_t apex[SPR__MAX_RING]
                [SPR__MAX_RING]; /* of the triangle on chord (i,j), in the best of polygon i..j */
    double          before, after;
    spr__burden     was; /* of the present tetrahedra */
} spr__ring;

/* Fills the ring of edge e of t. Returns 0 if the edge is constrained or on a wall, if more than
 * most tetrahedra are around it, or if one of them is worse than least. */
static int spr__ring_set(const spr__state *s, spr__ring *r, delaunay_handle t, int e, int most,
                         double least)
{
    const delaunay_mesh *m = s->mesh;
    int i = delaunay_edge_order(e)[0], j = delaunay_edge_order(e)[1];
    int k = delaunay_edge_order(5 - e)[0], l = delaunay_edge_order(5 - e)[1];
    delaunay_handle first = t;
    if (m->flags && (m->flags[t] & DELAUNAY_EDGE_BIT(e))) return 0;
    if (e == 1 || e == 4) { /* (0,2,1,3) and (1,3,0,2) are odd: turn the other way */
        int swap = k;
        k = l;
        l = swap;
    }
    r->a = m->tets[t].v[i];
    r->b = m->tets[t].v[j];
    r->before = HUGE_VAL;
    r->was.num = 0;
    r->was.weight = 0;
    for (r->n = 0; r->n < most; r->n++) {
        const delaunay_tet *x = &m->tets[t];
        uint32_t next = x->v[l];
        r->t[r->n] = t;
        r->v[r->n] = x->v[k];
        r->before = spr__min(r->before, s->value[t]);
        spr__burden_add(s, &r->was, s->value[t]);
        if (r->before < least || spr__is_wall(m, t, k)) return 0;
        t = x->n[k] / 4;
        if (t == first) {
            r->n++;
            return 1;
        }
        x = &m->tets[t];
        k = delaunay_local_index(x, next);
        i = delaunay_local_index(x, r->a);
        j = delaunay_local_index(x, r->b);
        l = 6 - i - j - k;
    }
    return 0;
}

static double spr__ring_triangle(const spr__state *s, const spr__ring *r, int i, int k, int j,
                                 double floor_)
{
    const delaunay_mesh *m = s->mesh;
    const double *p = spr__point(m, r->v[i]), *q = spr__point(m, r->v[k]),
                 *o = spr__point(m, r->v[j]);
    double up = spr__quality(s, p, q, o, spr__point(m, r->b));
    if (up <= floor_) return up;
    return spr__min(up, spr__quality(s, p, o, q, spr__point(m, r->a)));
}

/* Adds to b the new tetrahedra on chord (i,j) and on the chords below it. */
static void spr__ring_burden(const spr__state *s, const spr__ring *r, int i, int j, spr__burden *b)
{
    const delaunay_mesh *m = s->mesh;
    const double *p = spr__point(m, r->v[i]), *q, *o = spr__point(m, r->v[j]);
    int k = r->apex[i][j];
    if (j - i < 2) return;
    q = spr__point(m, r->v[k]);
    spr__burden_add(s, b, spr__quality(s, p, q, o, spr__point(m, r->b)));
    spr__burden_add(s, b, spr__quality(s, p, o, q, spr__point(m, r->a)));
    spr__ring_burden(s, r, i, k, b);
    spr__ring_burden(s, r, k, j, b);
}

/* Best triangulation of the ring by dynamic programming [Klincsek 1980; Shewchuk 2002]. Returns 1
 * if it gains. */
static int spr__ring_solve(const spr__state *s, spr__ring *r)
{
    double best[SPR__MAX_RING][SPR__MAX_RING], floor_ = spr__floor(s, r->before), q;
    spr__burden is = {0, 0};
    int n = r->n, i, j, k, span;
    if (s->tidy && r->was.num > 1) floor_ = SPR__MORE * r->before;
    if (n < 3) return 0;
    for (i = 0; i + 1 < n; i++) best[i][i + 1] = HUGE_VAL;
    for (span = 2; span < n; span++)
        for (i = 0; i + span < n; i++) {
            j = i + span;
            best[i][j] = -HUGE_VAL;
            r->apex[i][j] = 0;
            for (k = i + 1; k < j; k++) {
                double least = spr__max(floor_, best[i][j]);
                q = spr__min(best[i][k], best[k][j]);
                if (q > least) q = spr__min(q, spr__ring_triangle(s, r, i, k, j, least));
                if (q <= least) continue;
                best[i][j] = q;
                r->apex[i][j] = (uint8_t)k;
            }
        }
    r->after = best[0][n - 1];
    if (!(r->after > floor_)) return 0;
    if (r->after >= s->target) return 1;
    spr__ring_burden(s, r, 0, n - 1, &is);
    return spr__is_gain(s, r->before, r->after, r->was, is);
}

/* The new tetrahedra on chord (i,j) and on the chords below it. Returns their number. */
static int spr__ring_tets(const spr__ring *r, int i, int j, uint32_t (*out)[4])
{
    int n = 0, k = r->apex[i][j];
    if (j - i < 2) return 0;
    out[0][0] = r->v[i]; out[0][1] = r->v[k]; out[0][2] = r->v[j]; out[0][3] = r->b;
    out[1][0] = r->v[i]; out[1][1] = r->v[j]; out[1][2] = r->v[k]; out[1][3] = r->a;
    n = 2;
    n += spr__ring_tets(r, i, k, out + n);
    n += spr__ring_tets(r, k, j, out + n);
    return n;
}

/* Plans to replace some tetrahedra by others, given by their vertices. Returns what a plan function
 * returns. */
static int spr__plan_exchange(delaunay_plan *plan, const delaunay_handle *old, size_t num_old,
                              uint32_t (*tets)[4], int num_new)
{
    int answer = DELAUNAY_PLAN_COMMIT, i;
    size_t j;
    for (j = 0; j < num_old && answer > 0; j++) answer = delaunay_plan_remove(plan, old[j]);
    for (i = 0; i < num_new && answer > 0; i++)
        answer = delaunay_plan_add(plan, tets[i][0], tets[i][1], tets[i][2], tets[i][3]);
    return answer;
}

static int spr__all_positive(const delaunay_mesh *m, uint32_t (*v)[4], int n)
{
    int i;
    for (i = 0; i < n; i++)
        if (delaunay_orient3d(spr__point(m, v[i][0]), spr__point(m, v[i][1]),
                              spr__point(m, v[i][2]), spr__point(m, v[i][3])) <= 0)
            return 0;
    return 1;
}

/* Removes the edge of t that gains most, of those around which something has changed since t was
 * last tried: both its ends have a later stamp. */
static int spr__plan_edges(const spr__state *s, delaunay_handle t, delaunay_plan *plan)
{
    const uint32_t *v = s->mesh->tets[t].v;
    uint32_t tets[2 * SPR__MAX_RING][4];
    const uint32_t kept = spr__case_of(s, t)->kept;
    spr__ring ring, best;
    int e, n;
    best.n = 0;
    best.after = -HUGE_VAL;
    for (e = 0; e < 6; e++) {
        const uint8_t *o = delaunay_edge_order(e);
        if (s->stamp[v[o[0]]] < kept || s->stamp[v[o[1]]] < kept) continue;
        if (!spr__ring_set(s, &ring, t, e, SPR__MAX_RING, -HUGE_VAL) ||
            !spr__ring_solve(s, &ring) || ring.after <= best.after)
            continue;
        n = spr__ring_tets(&ring, 0, ring.n - 1, tets);
        if (!spr__all_positive(s->mesh, tets, n)) continue;
        best = ring;
        if (best.after >= s->target) break;
    }
    if (best.n == 0) return DELAUNAY_PLAN_NOTHING;
    n = spr__ring_tets(&best, 0, best.n - 1, tets);
    return spr__plan_exchange(plan, best.t, (size_t)best.n, tets, n);
}

/* -- flips for the mean quality */

enum {
    SPR__MEAN_RING = 7,      /* tetrahedra around an edge, at most */
    SPR__MEAN_PLANS = 20000, /* in a pass at most, and in addition: */
    SPR__MEAN_SHARE = 64,    /* one for so many tetrahedra */
    SPR__MEAN_PASSES = 3,
    SPR__MEAN_BATCH = 1024
};

/* The least gain that is worth a flip; what gains is the sum of (quality - mean). */
#define SPR__MEAN_GAIN 0.01

/* A flip: num_old tetrahedra of the mesh, and the vertices of num_new that may replace them. */
typedef struct spr__exchange {
    delaunay_handle t[SPR__MAX_RING];
    uint32_t        tets[2 * SPR__MAX_RING][4];
    int             num_old, num_new;
    double          gain;
} spr__exchange;

/* The triangulation of the ring with the largest sum of (quality - mean) and no tetrahedron worse
 * than the worst that is there now. Returns 0 if there is none. */
static int spr__ring_solve_mean(const spr__state *s, spr__ring *r)
{
    const delaunay_mesh *m = s->mesh;
    double best[SPR__MAX_RING][SPR__MAX_RING], q, sum;
    int n = r->n, i, j, k, span;
    if (n < 3) return 0;
    for (i = 0; i + 1 < n; i++) best[i][i + 1] = 0;
    for (span = 2; span < n; span++)
        for (i = 0; i + span < n; i++) {
            j = i + span;
            best[i][j] = -HUGE_VAL;
            for (k = i + 1; k < j; k++) {
                const double *x = spr__point(m, r->v[i]), *y = spr__point(m, r->v[k]),
                             *z = spr__point(m, r->v[j]);
                sum = best[i][k] + best[k][j];
                if (sum + 2 * (1 - s->mean) <= best[i][j]) continue;
                q = spr__quality(s, x, y, z, spr__point(m, r->b));
                if (q < r->before) continue;
                sum += q - s->mean;
                q = spr__quality(s, x, z, y, spr__point(m, r->a));
                if (q < r->before) continue;
                sum += q - s->mean;
                if (sum <= best[i][j]) continue;
                best[i][j] = sum;
                r->apex[i][j] = (uint8_t)k;
            }
        }
    r->after = best[0][n - 1];
    return r->after > -HUGE_VAL;
}

/* Lowers least to the three measures of a tetrahedron, unless its quality is so high that it has no
 * extreme angle. */
static void spr__least_extremes(const spr__state *s, const uint32_t *v, double *least)
{
    double e[3];
    int k;
    if (spr__quality_of(s, v) > s->target + SPR__ROUND) return;
    spr__extremes(spr__point(s->mesh, v[0]), spr__point(s->mesh, v[1]), spr__point(s->mesh, v[2]),
                  spr__point(s->mesh, v[3]), e);
    for (k = 0; k < 3; k++) least[k] = spr__min(least[k], e[k]);
}

/* Whether no angle of the new tetrahedra is extreme, or more extreme than the old ones have. */
static int spr__exchange_spares_angles(const spr__state *s, const spr__exchange *x)
{
    double was[3] = {1, 1, 1}, is[3] = {1, 1, 1};
    int i, k;
    for (i = 0; i < x->num_new && s->gamma; i++)
        spr__least_extremes(s, x->tets[i], is);
    for (i = 0; i < x->num_old && spr__min(is[0], spr__min(is[1], is[2])) < 1; i++)
        spr__least_extremes(s, s->mesh->tets[x->t[i]].v, was);
    for (k = 0; k < 3; k++)
        if (is[k] < was[k]) return 0;
    return 1;
}

/* Whether the mean rises, and nothing that is bad or extreme becomes worse. */
static int spr__is_exchange_better(const spr__state *s, spr__exchange *x)
{
    spr__burden was = spr__burden_of(s, x->t, (size_t)x->num_old), is = {0, 0};
    double worst = spr__worst_of(s, x->t, (size_t)x->num_old), q;
    int i;
    for (x->gain = 0, i = 0; i < x->num_old; i++) x->gain -= s->value[x->t[i]] - s->mean;
    for (i = 0; i < x->num_new; i++) {
        q = spr__quality_of(s, x->tets[i]);
        if (q < worst) return 0;
        x->gain += q - s->mean;
        spr__burden_add(s, &is, q);
    }
    return x->gain > SPR__MEAN_GAIN && is.num <= was.num && is.weight <= SPR__MORE * was.weight &&
           spr__exchange_spares_angles(s, x) && spr__all_positive(s->mesh, x->tets, x->num_new);
}

/* The removal of edge e of t. Returns 1 if it is better, and t the worst around the edge. */
static int spr__exchange_edge(const spr__state *s, delaunay_handle t, int e, spr__exchange *x)
{
    spr__ring r;
    double sum = 0;
    int i;
    if (!spr__ring_set(s, &r, t, e, SPR__MEAN_RING, s->value[t]) || !spr__ring_solve_mean(s, &r))
        return 0;
    for (i = 0; i < r.n; i++) sum += s->value[r.t[i]] - s->mean;
    if (!(r.after - sum > SPR__MEAN_GAIN)) return 0;
    x->num_old = r.n;
    memcpy(x->t, r.t, sizeof x->t);
    x->num_new = spr__ring_tets(&r, 0, r.n - 1, x->tets);
    return spr__is_exchange_better(s, x);
}

/* The flip of facet i to the edge between the two vertices opposite it. Returns 1 if it is better,
 * and t the worse of the two. */
static int spr__exchange_facet(const spr__state *s, delaunay_handle t, int i, spr__exchange *x)
{
    const delaunay_mesh *m = s->mesh;
    const uint8_t *o = delaunay_facet_order(i);
    const uint32_t *v = m->tets[t].v;
    delaunay_handle n = m->tets[t].n[i];
    int k;
    if (spr__is_wall(m, t, i) || s->value[n / 4] < s->value[t]) return 0;
    x->num_old = 2;
    x->num_new = 3;
    x->t[0] = t;
    x->t[1] = n / 4;
    for (k = 0; k < 3; k++) {
        x->tets[k][0] = v[o[(k + 1) % 3]];
        x->tets[k][1] = v[o[k]];
        x->tets[k][2] = m->tets[n / 4].v[n % 4];
        x->tets[k][3] = v[i];
    }
    return spr__is_exchange_better(s, x);
}

static int spr__plan_mean(void *user, const delaunay_mesh *m, delaunay_worker *worker, size_t item,
                          delaunay_plan *plan)
{
    const spr__state *s = (const spr__state *)user;
    delaunay_handle t = s->items.items[item];
    spr__exchange best, x;
    int i;
    (void)worker;
    if (delaunay_is_deleted(m, t) || s->value[t] >= s->fair) return DELAUNAY_PLAN_NOTHING;
    best.num_old = best.num_new = 0;
    for (best.gain = 0, i = 0; i < 10; i++)
        if ((i < 6 ? spr__exchange_edge(s, t, i, &x) : spr__exchange_facet(s, t, i - 6, &x)) &&
            x.gain > best.gain)
            best = x;
    if (!(best.gain > 0)) return DELAUNAY_PLAN_NOTHING;
    return spr__plan_exchange(plan, best.t, (size_t)best.num_old, best.tets, best.num_new);
}

/* ---- >>reconnection ----------------------------------------------------------------------- */

/* A cavity that grows by one vertex at a time [Marot 2020, 6.3]. */
typedef struct spr__cavity {
    delaunay_handle t[DELAUNAY_WINDOW_TETS];
    uint32_t        v[DELAUNAY_WINDOW_VERTICES];
    int             num_tets, num_vertices, scanned;
    double          before;
    /* facets of the cavity that are no walls: the vertex and the tetrahedron beyond each */
    uint32_t        ahead[4 * DELAUNAY_WINDOW_TETS];
    delaunay_handle behind[4 * DELAUNAY_WINDOW_TETS];
    int             num_ahead;
} spr__cavity;

/* Whether t is among the tetrahedra from this position on. */
static int spr__cavity_has_tet(const spr__cavity *c, int from, delaunay_handle t)
{
    int i;
    for (i = c->num_tets; i-- > from;)
        if (c->t[i] == t) return 1;
    return 0;
}

static int spr__cavity_has_vertex(const spr__cavity *c, uint32_t v)
{
    int i;
    for (i = 0; i < c->num_vertices; i++)
        if (c->v[i] == v) return 1;
    return 0;
}

static int spr__cavity_add(const spr__state *s, spr__cavity *c, delaunay_handle t)
{
    if (c->num_tets == DELAUNAY_WINDOW_TETS) return 0;
    c->before = spr__min(c->before, s->value[t]);
    c->t[c->num_tets++] = t;
    return 1;
}

/* Scans the facets of tetrahedra not yet scanned; a tetrahedron beyond that has all its vertices in
 * the cavity joins it. Returns 0 if they are too many. */
static int spr__cavity_scan(const spr__state *s, spr__cavity *c)
{
    const delaunay_mesh *m = s->mesh;
    const int from = c->scanned; /* those before were known when the facets ahead were listed */
    int i, k;
    for (; c->scanned < c->num_tets; c->scanned++)
        for (i = 0; i < 4; i++) {
            delaunay_handle t = c->t[c->scanned], n = m->tets[t].n[i];
            uint32_t apex;
            if (spr__is_wall(m, t, i) || spr__cavity_has_tet(c, 0, n / 4)) continue;
            apex = m->tets[n / 4].v[n % 4];
            if (spr__cavity_has_vertex(c, apex)) {
                if (!spr__cavity_add(s, c, n / 4)) return 0;
            } else {
                c->ahead[c->num_ahead] = apex;
                c->behind[c->num_ahead++] = n / 4;
            }
        }
    for (i = k = 0; i < c->num_ahead; i++) { /* forget those that have joined */
        if (spr__cavity_has_tet(c, from, c->behind[i])) continue;
        c->ahead[k] = c->ahead[i];
        c->behind[k++] = c->behind[i];
    }
    c->num_ahead = k;
    return 1;
}

/* Begins a cavity with n tetrahedra and their vertices, not yet scanned. Returns 0 if they are too
 * many. */
static int spr__cavity_set(const spr__state *s, spr__cavity *c, const delaunay_handle *t, size_t n)
{
    size_t i;
    int k;
    c->num_tets = c->num_vertices = c->scanned = c->num_ahead = 0;
    c->before = HUGE_VAL;
    for (i = 0; i < n; i++) {
        const uint32_t *v = s->mesh->tets[t[i]].v;
        if (!spr__cavity_add(s, c, t[i])) return 0;
        for (k = 0; k < 4; k++) {
            if (spr__cavity_has_vertex(c, v[k])) continue;
            if (c->num_vertices == DELAUNAY_WINDOW_VERTICES) return 0;
            c->v[c->num_vertices++] = v[k];
        }
    }
    return 1;
}

/* Adds the vertex that is beyond most facets, of several the one with the smallest sum of
 * qualities, and all tetrahedra that then have all their vertices in the cavity. Returns 0 if it
 * cannot grow. */
static int spr__cavity_grow(const spr__state *s, spr__cavity *c)
{
    uint32_t best = 0;
    int i, j, count, most = 0;
    double sum, least = 0;
    if (c->num_vertices == DELAUNAY_WINDOW_VERTICES) return 0;
    for (i = 0; i < c->num_ahead; i++) {
        for (j = 0; j < i && c->ahead[j] != c->ahead[i]; j++) {}
        if (j < i) continue;
        for (sum = 0, count = 0; j < c->num_ahead; j++)
            if (c->ahead[j] == c->ahead[i]) {
                count++;
                sum += s->value[c->behind[j]];
            }
        if (count > most || (count == most && sum < least)) {
            best = c->ahead[i];
            most = count;
            least = sum;
        }
    }
    if (most == 0) return 0;
    c->v[c->num_vertices++] = best;
    for (i = 0; i < c->num_ahead; i++)
        if (c->ahead[i] == best && !spr__cavity_has_tet(c, c->scanned, c->behind[i]) &&
            !spr__cavity_add(s, c, c->behind[i]))
            return 0;
    return spr__cavity_scan(s, c);
}

static double spr__search_quality(void *user, const double *a, const double *b, const double *c,
                                  const double *d)
{
    const spr__state *s = (const spr__state *)user;
    return spr__quality(s, a, b, c, d);
}

static double spr__search_weight(void *user, double quality)
{
    return spr__weight((const spr__state *)user, quality);
}

/* Sets the quality functions of a search. A function of the caller, which may be slow, is called
 * once per tetrahedron. */
static void spr__search_by(const spr__state *s, delaunay_search *search)
{
    search->quality = spr__search_quality;
    search->qualities = s->gamma || s->rounding ? spr__search_qualities : NULL;
    search->user = (void *)(uintptr_t)s;
}

/* Qualities of the result of a search; returns their least. */
static double spr__result_values(const spr__state *s, const delaunay_window *window,
                                 const delaunay_search *search, double *value)
{
    double worst = HUGE_VAL;
    uint32_t v[4], k;
    int i;
    for (k = 0; k < search->num_tets; k++) {
        for (i = 0; i < 4; i++) v[i] = window->vertices[search->tets[k][i]];
        value[k] = spr__quality_of(s, v);
        worst = spr__min(worst, value[k]);
    }
    return worst;
}

static size_t spr__count_below(const double *value, size_t n, double limit)
{
    size_t i, num = 0;
    for (i = 0; i < n; i++) num += value[i] < limit;
    return num;
}

/* Searches for a triangulation with fewer bad tetrahedra, none worse than the worst that is there,
 * and no more very bad ones (below 1/2, 1/4, 1/8 of the target). Returns 1 if it is found. */
static int spr__reconnect_tidily(const spr__state *s, delaunay_worker *worker,
                                 const delaunay_window *window, double before, uint32_t max_nodes,
                                 delaunay_search *search)
{
    double was[DELAUNAY_WINDOW_TETS], is[DELAUNAY_WINDOW_TETS], limit;
    uint32_t i, n = window->num_tets;
    for (i = 0; i < n; i++) was[i] = s->value[window->tets[i]];
    memset(search, 0, offsetof(delaunay_search, tets));
    search->objective = DELAUNAY_FEWER_BAD;
    spr__search_by(s, search);
    search->bound = spr__max(before, 0) / SPR__MORE; /* the worst may stay, but for rounding */
    search->good = s->target;
    search->num_bad = (uint32_t)spr__count_below(was, n, s->target);
    search->max_nodes = max_nodes;
    if (delaunay_reconnect(s->mesh, worker, window, search) <= 0) return 0;
    search->proven = 0; /* in another order, another result may be found */
    if (spr__result_values(s, window, search, is) < before) return 0;
    for (limit = 0.5 * s->target, i = 0; i < 3; i++, limit *= 0.5)
        if (spr__count_below(is, search->num_tets, limit) > spr__count_below(was, n, limit))
            return 0;
    return 1;
}

enum { SPR__TIDY_POINTS = 16 }; /* of a cavity that is searched for fewer bad ones, at most */

/* Answers of spr__reconnect. */
enum {
    SPR__FOUND = 1,
    SPR__NO_GAIN = 0, /* the best result gains less than is asked of a change there */
    SPR__NEVER = -1,  /* it is proven that there is no result */
    SPR__NOT_SO = -2  /* no result within max_nodes, in this order of the tetrahedra */
};

/* The best triangulation of a cavity, if it gains. drop: an inner vertex to leave out, or 0. */
static int spr__reconnect(const spr__state *s, delaunay_worker *worker, const spr__cavity *c,
                          uint32_t drop, uint32_t max_nodes, delaunay_window *window,
                          delaunay_search *search)
{
    const size_t n = (size_t)c->num_tets;
    const double before = c->before;
    double value[DELAUNAY_WINDOW_TETS], worst;
    spr__burden was = spr__burden_of(s, c->t, n), is = {0, 0};
    uint32_t i;
    int proven = 1;
    if (!delaunay_window_set(window, s->mesh, c->t, n, DELAUNAY_WINDOW_VERTICES, 1, 1))
        return SPR__NEVER;
    for (i = 0; drop && i < window->num_vertices; i++)
        if (window->vertices[i] == drop) window->dropped = 1u << i;
    if (drop && (window->dropped & ~window->interior)) return SPR__NEVER;
    if (s->tidy && window->num_vertices <= SPR__TIDY_POINTS) {
        if (spr__reconnect_tidily(s, worker, window, before, max_nodes, search)) return SPR__FOUND;
        proven = search->proven;
    }
    memset(search, 0, offsetof(delaunay_search, tets));
    search->objective = DELAUNAY_BEST_QUALITY;
    spr__search_by(s, search);
    search->bound = s->tidy ? SPR__MORE * before : spr__floor(s, spr__max(before, 0));
    search->good = s->target;
    search->num_bad = (uint32_t)(was.num + spr__may_add(s, before, s->target));
    search->weigh = spr__search_weight;
    search->max_weight = s->tidy || s->lift ? HUGE_VAL : SPR__MORE * was.weight;
    search->max_nodes = max_nodes;
    if (delaunay_reconnect(s->mesh, worker, window, search) <= 0)
        return proven && search->proven ? SPR__NEVER : SPR__NOT_SO;
    if (search->value >= s->target) return SPR__FOUND;
    worst = spr__result_values(s, window, search, value); /* rounded as they will be in the mesh */
    for (i = 0; i < search->num_tets; i++) spr__burden_add(s, &is, value[i]);
    return spr__is_gain(s, before, spr__min(worst, search->value), was, is) ? SPR__FOUND
                                                                            : SPR__NO_GAIN;
}

/* The effort of a level: the numbers of vertices at which a growing cavity is searched (from first
 * to last, by step), and the limit of nodes of each search. */
typedef struct spr__effort {
    int      first, step, last;
    uint32_t nodes;
} spr__effort;

/* Hash keys of a cavity, with the positions of its vertices. A collision of keys may hide a result,
 * but never lead to a wrong one. */
typedef struct spr__key {
    uint64_t set; /* of its tetrahedra, in any order */
    uint64_t way; /* of its tetrahedra in this order, and of the limit of nodes */
} spr__key;

static uint64_t spr__mix(uint64_t x)
{
    x *= UINT64_C(0x9E3779B97F4A7C15);
    return x ^ (x >> 29);
}

static spr__key spr__cavity_key(const spr__state *s, const spr__cavity *c, uint32_t nodes)
{
    spr__key key = {0, nodes};
    uint64_t x[3], h;
    int i, k;
    for (i = 0; i < c->num_tets; i++) {
        const uint32_t *v = s->mesh->tets[c->t[i]].v;
        for (h = 0, k = 0; k < 4; k++) h = spr__mix(h + v[k]);
        key.set += h;
        key.way = spr__mix(key.way + h);
    }
    for (i = 0; i < c->num_vertices; i++) {
        memcpy(x, spr__point(s->mesh, c->v[i]), sizeof x);
        for (h = c->v[i], k = 0; k < 3; k++) h = spr__mix(h + x[k]);
        key.set += h;
    }
    key.set = spr__mix(key.set + (uint64_t)s->tidy + 2 * (uint64_t)s->lift +
                       4 * (uint64_t)spr__may_add(s, c->before, s->target));
    key.way = spr__mix(key.way + key.set);
    key.set += key.set == 0;
    key.way += key.way == 0;
    return key;
}

static uint32_t *spr__vain_slot(const spr__state *s, uint64_t key)
{
    return &s->vain[key >> (64 - s->vain_bits)];
}

static int spr__is_vain(const spr__state *s, spr__key key)
{
    return *spr__vain_slot(s, key.set) == (uint32_t)key.set ||
           *spr__vain_slot(s, key.way) == (uint32_t)key.way;
}

/* Reconnects a cavity that grows around t. Cavities that were searched in vain before, around this
 * tetrahedron or another one, are not searched again. The worst quality of the result must not be
 * below least. */
static int spr__plan_grow(const spr__state *s, delaunay_worker *worker, delaunay_handle t,
                          delaunay_plan *plan, spr__effort effort, double least)
{
    spr__cavity c;
    delaunay_window window;
    delaunay_search search;
    int next = effort.first, vain = 0, answer;
    int more = spr__cavity_set(s, &c, &t, 1) && spr__cavity_scan(s, &c);
    while (more && next <= effort.last) {
        spr__key key;
        more = spr__cavity_grow(s, &c);
        if (c.num_vertices < next && more) continue;
        if (c.num_vertices < effort.first) break;
        next = c.num_vertices + effort.step;
        key = spr__cavity_key(s, &c, effort.nodes);
        if (spr__is_vain(s, key)) continue;
        answer = spr__reconnect(s, worker, &c, 0, effort.nodes, &window, &search);
        if (answer == SPR__FOUND)
            return search.value < least ? DELAUNAY_PLAN_NOTHING
                                        : delaunay_plan_window(plan, &window, &search);
        if (answer != SPR__NO_GAIN)
            plan->data[SPR__VAIN + vain++ % SPR__MAX_VAIN] =
                answer == SPR__NEVER ? key.set : key.way;
    }
    return DELAUNAY_PLAN_NOTHING;
}

/* -- removal of a vertex */

static double spr__distance2(const double *a, const double *b)
{
    double d[3];
    spr__sub(a, b, d);
    return spr__dot(d, d);
}

/* The neighbours of v; and the longest squared edge, among those at v and two of the three of each
 * facet of its link. Returns the number of neighbours. */
static int spr__neighbours(const delaunay_mesh *m, uint32_t v, const delaunay_list *star,
                           uint32_t *seen, double *longest)
{
    int num = 0, i, k;
    size_t j;
    *longest = 0;
    for (j = 0; j < star->count; j++) {
        const uint32_t *x = m->tets[star->items[j]].v;
        for (k = 0; k < 4; k++) {
            const double *p = spr__point(m, x[k]);
            if (x[k] == v) continue;
            *longest = spr__max(*longest, spr__distance2(p, spr__point(m, v)));
            *longest = spr__max(*longest, spr__distance2(p, spr__point(m, x[(k + 1) & 3])));
            for (i = 0; i < num && seen[i] != x[k]; i++) {}
            if (i == num) seen[num++] = x[k];
        }
    }
    return num;
}

/* The worst quality if v is contracted to a neighbour, which is then joined to the facets of the
 * link of v; ends with the first one not above floor_. *is: their burden. A new edge much longer
 * than the old ones counts as inverted. */
static double spr__contracted(const spr__state *s, uint32_t v, const delaunay_list *star,
                              uint32_t neighbour, double longest, double floor_, spr__burden *is)
{
    const delaunay_mesh *m = s->mesh;
    const double *p = spr__point(m, neighbour);
    double worst = HUGE_VAL, q;
    size_t i;
    int k;
    is->num = 0;
    is->weight = 0;
    for (i = 0; i < star->count && worst > floor_; i++) {
        uint32_t b[3];
        if (delaunay_local_index(&m->tets[star->items[i]], neighbour) >= 0) continue;
        spr__base_of(m, star->items[i], v, b);
        q = spr__quality_on(s, b, p);
        for (k = 0; k < 3; k++)
            if (spr__distance2(spr__point(m, b[k]), p) > 1.6 * longest) q = -1;
        spr__burden_add(s, is, q);
        worst = spr__min(worst, q);
    }
    return worst;
}

/* What the worst quality must exceed after a contraction; in thinning, less than it was before. */
static double spr__contraction_floor(const spr__state *s, double before)
{
    if (s->thins) return spr__max(s->least, SPR__THINNED * before) / SPR__MORE;
    return s->tidy ? SPR__MORE * before : spr__floor(s, before);
}

/* Whether a contraction is to be made: by the rules for any change. In thinning also if the worst
 * quality here falls, though not below the worst of the mesh, and fewer bad ones weigh clearly
 * less. */
static int spr__contraction_pays(const spr__state *s, double before, double after,
                                 spr__burden was, spr__burden is)
{
    if (!s->thins || after > SPR__MORE * before) return spr__is_gain(s, before, after, was, is);
    return after >= s->least && is.num < was.num && is.weight < SPR__LIGHTER * was.weight;
}

/* Finds the best neighbour to contract v to. Returns 1 if that gains. */
static int spr__contract(const spr__state *s, uint32_t v, const delaunay_list *star,
                         spr__offer *offer)
{
    uint32_t seen[4 * SPR__MAX_HUB];
    double longest, floor_ = spr__contraction_floor(s, offer->before), worst;
    spr__burden was = spr__burden_of(s, star->items, star->count), is;
    int found = 0, num = spr__neighbours(s->mesh, v, star, seen, &longest), i;
    for (i = 0; i < num; i++) {
        worst = spr__contracted(s, v, star, seen[i], longest, floor_, &is);
        if (worst <= floor_ || !spr__contraction_pays(s, offer->before, worst, was, is)) continue;
        floor_ = offer->after = worst;
        offer->vertex = v;
        offer->ring = seen[i];
        found = 1;
    }
    return found;
}

static int spr__plan_contraction(const spr__state *s, delaunay_plan *plan, const spr__offer *offer)
{
    const delaunay_mesh *m = s->mesh;
    uint32_t tets[SPR__MAX_HUB][4];
    int n = 0;
    size_t j;
    for (j = 0; j < plan->star.count; j++) {
        delaunay_handle t = plan->star.items[j];
        if (delaunay_local_index(&m->tets[t], offer->ring) >= 0) continue;
        spr__base_of(m, t, offer->vertex, tets[n]);
        tets[n++][3] = offer->ring;
    }
    if (!spr__all_positive(m, tets, n)) return DELAUNAY_PLAN_NOTHING;
    return spr__plan_exchange(plan, plan->star.items, plan->star.count, tets, n);
}

enum {
    SPR__REFILL_POINTS = 26, /* of the cavity around a vertex that is removed, at most */
    SPR__REFILL_LARGE = 21,  /* from so many points on, searches seldom succeed */
    SPR__REFILL_STEP = 4,    /* points by which this cavity grows between two searches */
    SPR__REFILL_NODES = 1000 /* limit of a search */
};

/* Credit of large refills: nodes that they may visit in vain, in all. Where triangles are large
 * beside the edges inside, they would otherwise take most of the time. */
enum {
    SPR__REFILL_BEGIN = 200000, /* of a mesh, besides some for each tetrahedron: */
    SPR__REFILL_EACH = 6,
    SPR__REFILL_PATCH = 2000,   /* of an attempt at a patch */
    SPR__REFILL_LIFT = 100000,  /* at least, of a turn of lifting */
    SPR__REFILL_GAIN = 5000     /* that each success adds */
};

/* Retriangulates the star of v, which is in plan->star, without v: first the star alone, then
 * larger and larger cavities around it, large ones as long as there is credit. */
static int spr__plan_refill(const spr__state *s, delaunay_worker *worker, uint32_t v,
                            delaunay_plan *plan)
{
    spr__cavity c;
    delaunay_window window;
    delaunay_search search;
    int next = 0, more = spr__cavity_set(s, &c, plan->star.items, plan->star.count), answer;
    while (more && next <= SPR__REFILL_POINTS) {
        const int large = c.num_vertices >= SPR__REFILL_LARGE;
        if (large && s->refill_credit <= 0) break;
        if (c.num_vertices >= next) {
            search.nodes = 0;
            answer = spr__reconnect(s, worker, &c, v, SPR__REFILL_NODES, &window, &search);
            if (large) plan->data[SPR__COST] += 2 * (uint64_t)search.nodes + (answer == SPR__FOUND);
            if (answer == SPR__FOUND) return delaunay_plan_window(plan, &window, &search);
            next = c.num_vertices + SPR__REFILL_STEP;
        }
        more = c.scanned == 0 ? spr__cavity_scan(s, &c) : spr__cavity_grow(s, &c);
    }
    return DELAUNAY_PLAN_NOTHING;
}

/* Removes one of the vertices of t: by contraction of an edge; if thorough, by retriangulation of
 * its star, or a larger cavity, without it. Only vertices whose star has changed since this was
 * last tried in vain. */
static int spr__plan_removal(const spr__state *s, delaunay_worker *worker, delaunay_handle t,
                             delaunay_plan *plan, int thorough)
{
    const delaunay_mesh *m = s->mesh;
    spr__offer best, offer;
    delaunay_result result;
    int i;
    memset(&best, 0, sizeof best);
    for (i = 0; i < 4; i++) {
        uint32_t v = m->tets[t].v[i];
        if (!s->movable[v] || s->stays[v] > s->stamp[v]) continue;
        result = delaunay_vertex_star(m, worker, v, &plan->star);
        if (result != DELAUNAY_OK) return (int)result;
        if (plan->star.count > (thorough ? SPR__MAX_STAR : SPR__MAX_HUB)) continue;
        plan->data[SPR__IN_VAIN] |= 1u << i;
        if (thorough) {
            int answer = spr__plan_refill(s, worker, v, plan);
            if (answer != DELAUNAY_PLAN_NOTHING) return answer;
            continue;
        }
        offer.before = spr__worst_of(s, plan->star.items, plan->star.count);
        offer.after = -HUGE_VAL;
        if (spr__contract(s, v, &plan->star, &offer) &&
            (!best.vertex || offer.after - offer.before > best.after - best.before))
            best = offer;
    }
    if (!best.vertex) return DELAUNAY_PLAN_NOTHING;
    result = delaunay_vertex_star(m, worker, best.vertex, &plan->star);
    if (result != DELAUNAY_OK) return (int)result;
    return spr__plan_contraction(s, plan, &best);
}

/* -- insertion of a vertex */

/* A pit: the cavity of a new vertex. It grows across a facet if the facets beyond form better
 * tetrahedra with the vertex. */
typedef struct spr__pit {
    int             num_tets, num_facets;
    delaunay_handle t[SPR__MAX_CAVITY];
    delaunay_handle facet[SPR__MAX_STAR]; /* facets of the cavity, seen from inside: 4*t+i */
    double          value[SPR__MAX_STAR]; /* quality of each facet joined to the vertex */
    double          xyz[3], before, after;
} spr__pit;

static int spr__pit_has(const spr__pit *c, delaunay_handle t)
{
    int i;
    for (i = 0; i < c->num_tets; i++)
        if (c->t[i] == t) return 1;
    return 0;
}

static double spr__pit_facet(const spr__state *s, const spr__pit *c, delaunay_handle f)
{
    uint32_t b[3];
    spr__base(s->mesh, f, b);
    return spr__quality_on(s, b, c->xyz);
}

static int spr__pit_add(const spr__state *s, spr__pit *c, delaunay_handle t)
{
    const delaunay_mesh *m = s->mesh;
    int i, j, k;
    if (c->num_tets == SPR__MAX_CAVITY || c->num_facets + 4 > SPR__MAX_STAR) return 0;
    for (i = j = 0; i < c->num_facets; i++) {
        if (spr__beyond(m, c->facet[i]) == t) continue;
        c->facet[j] = c->facet[i];
        c->value[j++] = c->value[i];
    }
    c->num_facets = j;
    for (k = 0; k < 4; k++)
        if (!spr__pit_has(c, m->tets[t].n[k] / 4) || m->tets[t].n[k] == 0) {
            c->facet[c->num_facets] = 4 * t + (delaunay_handle)k;
            c->value[c->num_facets] = spr__pit_facet(s, c, c->facet[c->num_facets]);
            c->num_facets++;
        }
    c->before = spr__min(c->before, s->value[t]);
    c->t[c->num_tets++] = t;
    return 1;
}

/* Whether all facets that t would add to the pit are better for its vertex than the given quality,
 * which is that of the facet that t hides. */
static int spr__pit_wants(const spr__state *s, const spr__pit *c, delaunay_handle t, double than)
{
    const delaunay_mesh *m = s->mesh;
    int k;
    if (c->num_tets + 1 >= SPR__MAX_CAVITY || c->num_facets + 4 > SPR__MAX_STAR) return 0;
    for (k = 0; k < 4; k++) {
        delaunay_handle n = m->tets[t].n[k];
        if (n != 0 && spr__pit_has(c, n / 4)) continue;
        if (spr__pit_facet(s, c, 4 * t + (delaunay_handle)k) <= than) return 0;
    }
    return 1;
}

static void spr__pit_grow(const spr__state *s, spr__pit *c)
{
    const delaunay_mesh *m = s->mesh;
    int i, at;
    for (;;) {
        double worst = s->target;
        for (at = -1, i = 0; i < c->num_facets; i++) {
            delaunay_handle f = c->facet[i];
            if (c->value[i] >= worst || spr__is_wall(m, f / 4, (int)(f % 4))) continue;
            if (!spr__pit_wants(s, c, spr__beyond(m, f), c->value[i])) continue;
            worst = c->value[i];
            at = i;
        }
        if (at < 0 || !spr__pit_add(s, c, spr__beyond(m, c->facet[at]))) return;
    }
}

/* Whether the inside of the pit contains no vertex, no constrained edge and no wall. */
static int spr__pit_is_hollow(const spr__state *s, const spr__pit *c)
{
    const delaunay_mesh *m = s->mesh;
    int i, j, k;
    for (i = 0; i < c->num_tets; i++) {
        delaunay_handle t = c->t[i];
        for (k = 0; k < 4; k++)
            if (spr__is_wall(m, t, k) && m->tets[t].n[k] && spr__pit_has(c, m->tets[t].n[k] / 4))
                return 0;
        for (k = 0; k < 10; k++) {
            uint32_t a = m->tets[t].v[k < 4 ? k : delaunay_edge_order(k - 4)[0]];
            uint32_t b = m->tets[t].v[k < 4 ? k : delaunay_edge_order(k - 4)[1]];
            if (k >= 4 && (!m->flags || !(m->flags[t] & DELAUNAY_EDGE_BIT(k - 4)))) continue;
            for (j = 0; j < c->num_facets; j++) {
                const delaunay_tet *x = &m->tets[c->facet[j] / 4];
                int la = delaunay_local_index(x, a), lb = delaunay_local_index(x, b),
                    o = (int)(c->facet[j] % 4);
                if (la >= 0 && lb >= 0 && la != o && lb != o) break;
            }
            if (j == c->num_facets) return 0;
        }
    }
    return 1;
}

static void spr__pit_cone(const spr__state *s, const spr__pit *c, spr__cone *cone)
{
    const delaunay_mesh *m = s->mesh;
    int i;
    cone->n = 0;
    for (i = 0; i < c->num_facets; i++) {
        uint32_t b[3];
        spr__base(m, c->facet[i], b);
        spr__cone_add(cone, spr__point(m, b[0]), spr__point(m, b[1]), spr__point(m, b[2]));
    }
    spr__cone_close(s, cone);
}

/* A new edge must be longer than this part of the shortest edge of the pit's facets. */
#define SPR__ROOM      0.5
#define SPR__ROOM_FLAT 0.2 /* the same while lifting: the very worst are much flatter than that */
static int spr__pit_is_roomy(const spr__cone *cone, const double *p, double room)
{
    double shortest = HUGE_VAL, nearest = HUGE_VAL;
    size_t i;
    for (i = 0; i < cone->n; i++) {
        const double **v = spr__cone_corners(cone, i);
        nearest =
            spr__min(nearest, spr__min(spr__distance2(p, v[0]),
                                       spr__min(spr__distance2(p, v[1]), spr__distance2(p, v[2]))));
        shortest = spr__min(
            shortest, spr__min(spr__distance2(v[0], v[1]),
                               spr__min(spr__distance2(v[1], v[2]), spr__distance2(v[2], v[0]))));
    }
    return nearest > room * room * shortest;
}

/* The lack of a bad tetrahedron: the square of its distance to the target. */
static double spr__lack(const spr__state *s, double value)
{
    double d = s->target - value;
    return d > 0 ? d * d : 0;
}

/* A new vertex often replaces a very bad tetrahedron by several that are better but still bad. It
 * must halve the sum of their lacks without more bad ones, or improve a very bad one a lot. */
static int spr__pit_pays(const spr__state *s, const spr__pit *c)
{
    double was = 0, is = 0; /* sums of lacks */
    int more = 0, i;
    for (i = 0; i < c->num_facets; i++) {
        is += spr__lack(s, c->value[i]);
        more += c->value[i] < s->target;
    }
    for (i = 0; i < c->num_tets; i++) {
        was += spr__lack(s, s->value[c->t[i]]);
        more -= s->value[c->t[i]] < s->target;
    }
    if (more > spr__may_add(s, c->before, c->after)) return 0;
    if (s->lift) return 1;
    if (c->before < 0.4 * s->target) {
        if (c->after > 2 * c->before && c->after > 0.3 * s->target) return 1;
    } else if (more > 0) return 0;
    return is < 0.5 * was;
}

/* Grows the pit and moves its vertex in turn. Returns 1 if that gains. */
static int spr__pit_solve(const spr__state *s, spr__pit *c)
{
    spr__cone cone;
    int turn, i;
    c->after = -HUGE_VAL;
    for (turn = 0; turn < 3; turn++) {
        double value;
        spr__pit_grow(s, c);
        spr__pit_cone(s, c, &cone);
        value = spr__cone_value(s, &cone, c->xyz, -HUGE_VAL);
        value = spr__max_min(s, &cone, c->xyz, value, 10);
        for (i = 0; i < c->num_facets; i++) c->value[i] = spr__pit_facet(s, c, c->facet[i]);
        if (value <= c->after + 1e-3) break;
        c->after = value;
    }
    c->after = HUGE_VAL;
    for (i = 0; i < c->num_facets; i++) c->after = spr__min(c->after, c->value[i]);
    return c->after > spr__floor(s, c->before) && cone.n == (size_t)c->num_facets &&
           spr__pit_pays(s, c) && spr__cone_is_positive(&cone, c->xyz) &&
           spr__pit_is_roomy(&cone, c->xyz, s->is_lifting ? SPR__ROOM_FLAT : SPR__ROOM) &&
           spr__pit_is_hollow(s, c);
}

/* Nil: as good as flat. */
static int spr__is_nil(const spr__state *s, delaunay_handle t)
{
    return s->value[t] < SPR__NIL * s->target;
}

/* Adds the tetrahedra beyond facets that the vertex does not see from inside. Returns 0 if such a
 * facet is a wall, or if they are too many. */
static int spr__pit_clear(const spr__state *s, spr__pit *c)
{
    int i;
    for (i = 0; i < c->num_facets; i++) c->value[i] = spr__pit_facet(s, c, c->facet[i]);
    for (i = 0; i < c->num_facets; i++) {
        delaunay_handle f = c->facet[i];
        if (c->value[i] > 0) continue;
        if (spr__is_wall(s->mesh, f / 4, (int)(f % 4)) ||
            !spr__pit_add(s, c, spr__beyond(s->mesh, f)))
            return 0;
        i = -1; /* from the first one again: they have moved */
    }
    return 1;
}

/* Looks for a position of the vertex from which no facet is hidden: on the segment between two
 * points, closer and closer to the first. Returns 1 if it is found. */
static int spr__pit_look(const spr__state *s, spr__pit *c, const double *from, const double *to)
{
    const spr__pit begun = *c;
    double part;
    int k;
    for (part = 0.5; part > 1e-4; part *= 0.5, *c = begun) {
        for (k = 0; k < 3; k++) c->xyz[k] = from[k] + part * (to[k] - from[k]);
        if (spr__pit_clear(s, c)) return 1;
    }
    return 0;
}

/* The centroid of facet i of t. */
static void spr__facet_middle(const delaunay_mesh *m, delaunay_handle t, int i, double *middle)
{
    const uint8_t *o = delaunay_facet_order(i);
    const uint32_t *v = m->tets[t].v;
    int k;
    for (k = 0; k < 3; k++)
        middle[k] = (spr__point(m, v[o[0]])[k] + spr__point(m, v[o[1]])[k] +
                     spr__point(m, v[o[2]])[k]) /
                    3;
}

/* A heap: all nil tetrahedra that are connected with t, and their neighbours, with the new vertex
 * in one of the neighbours, close to a nil one. Nil tetrahedra fill the bends that rounding makes
 * in the plane polygons of a surface. They lie more or less in one plane, so that a vertex close to
 * it sees everything around them. Returns 1 if such a vertex is found. */
static int spr__pit_set_heap(const spr__state *s, spr__pit *c, delaunay_handle t)
{
    const delaunay_mesh *m = s->mesh;
    double lid[3], inside[3];
    int i, k, num;
    if (!s->lift || !spr__is_nil(s, t) || !spr__pit_add(s, c, t)) return 0;
    for (i = 0; i < c->num_tets; i++)
        for (k = 0; k < 4 && spr__is_nil(s, c->t[i]); k++) {
            delaunay_handle n = m->tets[c->t[i]].n[k] / 4;
            if (spr__is_wall(m, c->t[i], k) || spr__pit_has(c, n)) continue;
            if (!spr__pit_add(s, c, n)) return 0;
        }
    for (num = c->num_tets, i = 0; i < num; i++)
        for (k = 0; k < 4 && !spr__is_nil(s, c->t[i]); k++) {
            if (spr__is_wall(m, c->t[i], k) || !spr__is_nil(s, m->tets[c->t[i]].n[k] / 4)) continue;
            spr__facet_middle(m, c->t[i], k, lid);
            spr__middle(m, c->t[i], inside);
            if (spr__pit_look(s, c, lid, inside)) return 1;
        }
    return 0;
}

enum { SPR__HEAP = 7, SPR__PLACES = 8 };

/* Begins the k-th pit for t: at its centroid; at the middle of one of its edges, with all the
 * tetrahedra around that; at last, where nothing else helps, with a heap. Returns 0 if that is not
 * possible. */
static int spr__pit_set(const spr__state *s, spr__pit *c, delaunay_handle t, int k)
{
    const delaunay_mesh *m = s->mesh;
    const uint32_t *v = m->tets[t].v;
    spr__ring ring;
    int i;
    c->num_tets = c->num_facets = 0;
    c->before = HUGE_VAL;
    spr__middle(m, t, c->xyz);
    if (k == 0) return spr__pit_add(s, c, t);
    if (k == SPR__HEAP) return spr__pit_set_heap(s, c, t);
    for (i = 0; i < 3; i++)
        c->xyz[i] = (spr__point(m, v[delaunay_edge_order(k - 1)[0]])[i] +
                     spr__point(m, v[delaunay_edge_order(k - 1)[1]])[i]) /
                    2;
    if (!spr__ring_set(s, &ring, t, k - 1, s->is_lifting ? SPR__WIDE_RING : SPR__MAX_RING,
                       -HUGE_VAL))
        return 0;
    for (i = 0; i < ring.n; i++)
        if (!spr__pit_add(s, c, ring.t[i])) return 0;
    return 1;
}

/* The best pit for a new vertex in t or beside it. Returns 0 if there is none. */
static int spr__find_pit(const spr__state *s, delaunay_handle t, spr__pit *best)
{
    spr__pit pit;
    int k;
    best->num_tets = 0;
    best->after = best->before = 0;
    if (s->mesh->num_vertices - s->first_new >=
        (s->sweep == SPR__UTMOST ? s->max_new : s->max_new - s->max_new / 3))
        return 0;
    for (k = 0; k < SPR__PLACES; k++) {
        if (!spr__pit_set(s, &pit, t, k) || !spr__pit_solve(s, &pit)) continue;
        if (best->num_tets && pit.after - pit.before <= best->after - best->before) continue;
        *best = pit;
        if (best->after >= s->target) break;
    }
    return best->num_tets > 0;
}

static int spr__plan_pit(const spr__state *s, const spr__pit *pit, delaunay_plan *plan)
{
    int k, answer = delaunay_plan_vertex(plan, pit->xyz);
    for (k = 0; k < pit->num_tets && answer > 0; k++)
        answer = delaunay_plan_remove(plan, pit->t[k]);
    for (k = 0; k < pit->num_facets && answer > 0; k++) {
        uint32_t b[3];
        spr__base(s->mesh, pit->facet[k], b);
        answer = delaunay_plan_add(plan, b[0], b[1], b[2], DELAUNAY_PLAN_VERTEX(0));
    }
    return answer;
}

/* Inserts a vertex, unless reconnection reaches as much without one. */
static int spr__plan_insertion(const spr__state *s, delaunay_worker *worker, delaunay_handle t,
                               delaunay_plan *plan, spr__effort without)
{
    spr__pit pit;
    int answer;
    if (!spr__find_pit(s, t, &pit)) return DELAUNAY_PLAN_NOTHING;
    answer = s->options.no_reconnection ? DELAUNAY_PLAN_NOTHING
                                        : spr__plan_grow(s, worker, t, plan, without, pit.after);
    return answer != DELAUNAY_PLAN_NOTHING ? answer : spr__plan_pit(s, &pit, plan);
}

/* ---- >>schedule --------------------------------------------------------------------------- */

/* Numbers of plans of the level SPR__LARGE. */
enum {
    SPR__LARGE_PLANS = 300,   /* in vain; and more for larger meshes */
    SPR__LARGE_GAIN = 100,    /* that each success adds */
    SPR__LARGE_PORTION = 64   /* in one run, so that the successes count in time */
};

static int spr__is_off(const spr__state *s, int level)
{
    const spr_options *o = &s->options;
    switch (level) {
    case SPR__EDGES: return o->no_edge_removal;
    case SPR__SMOOTH: return o->no_smoothing;
    case SPR__REMOVE: return o->keep_vertices;
    case SPR__INSERT: return o->keep_vertices || s->max_new == 0;
    default: return o->no_reconnection;
    }
}

/* The first level from this one on that is not switched off. */
static uint8_t spr__level_from(const spr__state *s, int level)
{
    while (level < SPR__HOPELESS && spr__is_off(s, level)) level++;
    return (uint8_t)level;
}

static void spr__set_goal(delaunay_plan *plan, double goal)
{
    memcpy(&plan->data[SPR__GOAL], &goal, sizeof goal);
}

/* The quality that is worth trying for: the target, or nearly what the surface allows. */
static double spr__goal(const spr__state *s, delaunay_handle t)
{
    double bound;
    if (spr__case_of(s, t)->goal > 0) return (double)spr__case_of(s, t)->goal;
    bound = spr__bound(s, t, s->target, 1);
    return bound >= s->target ? s->target : 0.97 * bound;
}

static int spr__plan(void *user, const delaunay_mesh *m, delaunay_worker *worker, size_t item,
                     delaunay_plan *plan)
{
    static const spr__effort little = {7, 2, 10, 300}, medium = {12, 2, 16, 1000},
                             large = {20, 4, 32, 1000}, utmost = {14, 3, 32, 4000};
    const spr__state *s = (const spr__state *)user;
    delaunay_handle t = s->items.items[item];
    double goal;
    int answer;
    if (delaunay_is_deleted(m, t) || s->value[t] >= s->target) return DELAUNAY_PLAN_NOTHING;
    plan->data[SPR__IN_VAIN] = (uint64_t)spr__name(m->tets[t].v) << 32;
    goal = spr__goal(s, t);
    spr__set_goal(plan, goal);
    if (s->value[t] >= goal && !(s->thins && s->sweep == SPR__REMOVE)) return DELAUNAY_PLAN_NOTHING;
    switch (s->sweep) {
    case SPR__EDGES: return spr__plan_edges(s, t, plan);
    case SPR__SMOOTH: return spr__plan_smooth(s, worker, t, plan);
    case SPR__SMALL: return spr__plan_grow(s, worker, t, plan, little, 0);
    case SPR__REMOVE:
        if (s->gone >= s->max_gone) return DELAUNAY_PLAN_NOTHING;
        answer = spr__plan_removal(s, worker, t, plan, 0);
        return answer != DELAUNAY_PLAN_NOTHING ? answer : spr__plan_removal(s, worker, t, plan, 1);
    case SPR__INSERT: return spr__plan_insertion(s, worker, t, plan, medium);
    case SPR__MEDIUM: return spr__plan_grow(s, worker, t, plan, medium, 0);
    case SPR__LARGE: return spr__plan_grow(s, worker, t, plan, large, 0);
    default:
        answer = s->max_new ? spr__plan_insertion(s, worker, t, plan, medium)
                            : DELAUNAY_PLAN_NOTHING;
        return answer != DELAUNAY_PLAN_NOTHING ? answer
                                               : spr__plan_grow(s, worker, t, plan, utmost, 0);
    }
}

/* Makes room for one more case, and for case 0. Returns 0 if out of memory. */
static int spr__case_room(spr__state *s)
{
    size_t cap = (size_t)s->cap_cases + s->cap_cases / 2 + 64;
    spr__case *cases;
    if (s->num_cases && s->num_cases < s->cap_cases) return 1;
    if (cap > UINT32_MAX) return 0;
    cases = (spr__case *)delaunay_grow(s->memory, s->cases, s->cap_cases, cap, sizeof *cases);
    if (!cases) return 0;
    s->cases = cases;
    s->cap_cases = (uint32_t)cap;
    if (s->num_cases == 0) memset(&s->cases[s->num_cases++], 0, sizeof *cases);
    return 1;
}

/* Makes room in the arrays for all slots that are in use, and some more, and for all vertices.
 * Returns 0 if out of memory. */
static int spr__fit(spr__state *s)
{
    size_t tets = s->mesh->num_tets, vertices = s->mesh->cap_vertices, old = s->cap_tets;
    if (!s->cases && !spr__case_room(s)) return 0;
    if (tets > old) {
        double *value;
        spr__slot *at;
        tets += tets / 64 + 1024;
        if (tets > s->mesh->cap_tets) tets = s->mesh->cap_tets;
        value = (double *)delaunay_grow(s->memory, s->value, old, tets, sizeof *value);
        if (value) s->value = value;
        at = (spr__slot *)delaunay_grow_zeroed(s->memory, s->at, old, tets, sizeof *at);
        if (at) s->at = at;
        if (!value || !at) return 0;
        for (; old < tets; old++) s->value[old] = HUGE_VAL;
        s->cap_tets = (delaunay_handle)tets;
    }
    if (vertices > s->cap_vertices) {
        uint32_t *stamp = (uint32_t *)delaunay_grow_zeroed(s->memory, s->stamp, s->cap_vertices,
                                                           vertices, sizeof *stamp);
        uint32_t *still, *stays;
        uint8_t *movable;
        if (stamp) s->stamp = stamp;
        still = (uint32_t *)delaunay_grow_zeroed(s->memory, s->still, s->cap_vertices, vertices,
                                                 sizeof *still);
        if (still) s->still = still;
        stays = (uint32_t *)delaunay_grow_zeroed(s->memory, s->stays, s->cap_vertices, vertices,
                                                 sizeof *stays);
        if (stays) s->stays = stays;
        movable = (uint8_t *)delaunay_grow(s->memory, s->movable, s->cap_vertices, vertices,
                                           sizeof *movable);
        if (movable) s->movable = movable;
        if (!stamp || !still || !stays || !movable) return 0;
        memset(s->movable + s->cap_vertices, 1, vertices - s->cap_vertices);
        s->cap_vertices = (uint32_t)vertices;
    }
    return 1;
}

/* Gives t a case of its own. Returns 0 if out of memory. */
static int spr__open_case(spr__state *s, delaunay_handle t)
{
    if (s->at[t].number) return 1;
    if (s->free_cases.count) {
        s->at[t].number = (uint32_t)s->free_cases.items[--s->free_cases.count];
    } else {
        if (!spr__case_room(s)) return 0;
        s->at[t].number = s->num_cases++;
    }
    memset(spr__case_of(s, t), 0, sizeof *s->cases);
    return 1;
}

/* Forgets what was known about slot t, which has a new tetrahedron. If it is in the list, it keeps
 * its case, which is cleared. Returns 0 if out of memory. */
static int spr__close_case(spr__state *s, delaunay_handle t)
{
    uint32_t number = s->at[t].number;
    if (!number) return 1;
    if (s->at[t].listed) {
        memset(spr__case_of(s, t), 0, sizeof *s->cases);
        return 1;
    }
    s->at[t].number = 0;
    return delaunay_list_push(&s->free_cases, number) == DELAUNAY_OK;
}

/* Puts t into the list of bad tetrahedra, at the first level. Returns 0 if out of memory. */
static int spr__list(spr__state *s, delaunay_handle t)
{
    if (!spr__open_case(s, t)) return 0;
    if (s->at[t].listed) return 1;
    s->at[t].listed = 1;
    s->at[t].level = spr__level_from(s, 0);
    return delaunay_list_push(&s->bad, t) == DELAUNAY_OK;
}

/* Lists the bad tetrahedra. Returns 0 if out of memory. */
static int spr__find_bad(spr__state *s)
{
    delaunay_handle t;
    int ok = 1;
    for (t = 1; t < s->mesh->num_tets && ok; t++)
        if (s->value[t] < s->target) ok = spr__list(s, t);
    s->num_bad = s->bad.count;
    return ok;
}

/* Sets the quality of a slot, HUGE_VAL if it is empty, and keeps num_bad up to date. */
static void spr__set_value(spr__state *s, delaunay_handle t, double value)
{
    s->num_bad -= s->value[t] < s->target;
    s->num_bad += value < s->target;
    s->value[t] = value;
}

/* Updates a slot whose tetrahedron is new, or whose vertices moved. Returns 0 if out of memory. */
static int spr__renew(spr__state *s, delaunay_handle t, int is_new)
{
    const uint32_t *v = s->mesh->tets[t].v;
    int k;
    spr__set_value(s, t, spr__quality_of(s, v));
    s->at[t].level = spr__level_from(s, 0);
    if (is_new) {
        s->at[t].shaken = 0;
        s->at[t].listed = s->at[t].listed != 0;
        if (!spr__close_case(s, t)) return 0;
    }
    for (k = 0; k < 4; k++) s->stamp[v[k]] = delaunay_engine_round(s->engine);
    return s->value[t] >= s->target || spr__list(s, t);
}

/* What counts as a few bad tetrahedra, for the size of the mesh. */
static size_t spr__some(const spr__state *s)
{
    return 16 + (size_t)(s->report->before.num_tets / 250);
}

/* Sets how many bad ones a change may add: so many that there are no more than at the start even if
 * each change of a round does so; in the place of the very worst, as many as lifted_bad allows. */
static void spr__set_may_add(spr__state *s)
{
    uint64_t begun = s->report->before.num_below,
             spare = begun > s->num_bad ? (begun - s->num_bad) / s->in_flight : 0,
             lifted = s->lifted_bad > s->num_bad ? s->lifted_bad - s->num_bad : 0,
             most = begun > s->lifted_bad ? begun : s->lifted_bad,
             nil = most > s->num_bad ? most - s->num_bad : 0;
    if ((s->lifts > 2 && s->is_lifting) || s->raises) spare = 0;
    s->may_add = s->tidy ? 0 : s->is_patch || spare > SPR__MAX_STAR ? SPR__MAX_STAR : (int)spare;
    s->lift_adds = lifted > SPR__MAX_STAR ? SPR__MAX_STAR : (int)lifted;
    s->nil_adds = nil > SPR__MAX_STAR ? SPR__MAX_STAR : (int)nil;
}

static void spr__count(spr__state *s, const delaunay_plan *plan)
{
    s->changes++;
    if (s->sweep == SPR__REMOVE && !plan->num_new) s->gone++;
    if (s->sweep == SPR__MEAN) s->report->flipped++;
    else if (plan->num_new) s->report->vertices_inserted++;
    else if (s->sweep == SPR__EDGES) s->report->edges_removed++;
    else if (s->sweep == SPR__SMOOTH) s->report->smoothed++;
    else if (s->sweep == SPR__REMOVE) s->report->vertices_removed++;
    else s->report->reconnected++;
    if (s->sweep == SPR__LARGE && !s->is_patch) s->allowance[SPR__LARGE] += SPR__LARGE_GAIN;
}

/* Of spr__slot.listed: everything was tried once for this very tetrahedron; when something changes
 * nearby, the expensive levels are not tried again. */
enum { SPR__EXHAUSTED = 2 };

/* The last level that is tried for t, before SPR__UTMOST for the very worst. The closer t is to
 * what the surface allows, the fewer expensive levels are worth trying. */
static int spr__last_level(const spr__state *s, delaunay_handle t)
{
    const float held = spr__case_of(s, t)->goal;
    const double goal = (double)held;
    if (s->at[t].listed == SPR__EXHAUSTED) return SPR__INSERT;
    if (goal == 0 || held >= (float)s->target) return SPR__LARGE;
    return s->value[t] >= 0.8 * goal   ? SPR__INSERT
           : s->value[t] >= 0.4 * goal ? SPR__MEDIUM
                                       : SPR__LARGE;
}

/* The level of t after that of this sweep was tried in vain. */
static uint8_t spr__next_level(const spr__state *s, delaunay_handle t)
{
    uint8_t next = spr__level_from(s, s->sweep + 1);
    const double goal = (double)spr__case_of(s, t)->goal;
    if (next == SPR__HOPELESS || (goal > 0 && s->value[t] >= goal) ||
        (s->thins && s->sweep == SPR__REMOVE))
        return SPR__HOPELESS;
    if (next <= spr__last_level(s, t)) return next;
    if (s->at[t].listed == SPR__EXHAUSTED) return SPR__HOPELESS;
    return spr__level_from(s, SPR__UTMOST);
}

/* Takes what a plan has cost from the credit of large refills, and adds what a success gains. */
static void spr__charge_refill(spr__state *s, const delaunay_plan *plan)
{
    const uint64_t cost = plan->data[SPR__COST];
    s->refill_credit -= (int64_t)(cost / 2);
    if (cost & 1) s->refill_credit += SPR__REFILL_GAIN;
    s->credit_ended |= s->refill_credit <= 0;
}

static int spr__done(void *user, delaunay_mesh *m, delaunay_worker *worker, size_t item,
                     const delaunay_plan *plan)
{
    spr__state *s = (spr__state *)user;
    delaunay_handle t = s->items.items[item];
    size_t i;
    (void)worker;
    spr__charge_refill(s, plan);
    if (!spr__fit(s)) {
        s->failure = SPR_ERROR_OUT_OF_MEMORY;
        return 1;
    }
    if (!plan->committed && s->sweep == SPR__MEAN) {
        return 0;
    } else if (!plan->committed) {
        const uint32_t round_ = delaunay_engine_round(s->engine);
        spr__case *c = spr__case_of(s, t);
        double goal;
        memcpy(&goal, &plan->data[SPR__GOAL], sizeof goal);
        if (delaunay_is_deleted(m, t) || s->value[t] >= s->target) return 0;
        if (plan->data[SPR__IN_VAIN] >> 32 != spr__name(m->tets[t].v)) return 0; /* a new one */
        if (goal > 0) c->goal = goal >= s->target ? (float)s->target : (float)goal;
        if (s->at[t].level == s->sweep) s->at[t].level = spr__next_level(s, t);
        if (s->at[t].level == SPR__HOPELESS) s->at[t].listed = SPR__EXHAUSTED;
        c->tried = round_;
        if (s->is_lifting) c->lifted = round_;
        if (s->sweep == SPR__EDGES) c->kept = round_;
        for (i = 0; i < 4; i++)
            if (plan->data[SPR__IN_VAIN] >> i & 1)
                (s->sweep == SPR__REMOVE ? s->stays : s->still)[m->tets[t].v[i]] = round_;
        for (i = 0; i < SPR__MAX_VAIN; i++)
            if (plan->data[SPR__VAIN + i])
                *spr__vain_slot(s, plan->data[SPR__VAIN + i]) =
                    (uint32_t)plan->data[SPR__VAIN + i];
    } else {
        uint8_t restarts = 0;
        int ok = 1;
        spr__count(s, plan);
        for (i = plan->num_tets; i < plan->old_tets.count; i++)
            spr__set_value(s, plan->old_tets.items[i], HUGE_VAL);
        for (i = 0; i < plan->old_tets.count; i++)
            if (s->at[plan->old_tets.items[i]].restarts > restarts)
                restarts = s->at[plan->old_tets.items[i]].restarts;
        for (i = 0; i < plan->num_tets; i++) {
            ok &= spr__renew(s, plan->slots.items[i], 1);
            s->at[plan->slots.items[i]].restarts = restarts;
        }
        for (i = 0; plan->num_moved && i < plan->star.count; i++)
            ok &= spr__renew(s, plan->star.items[i], 0);
        if (!ok) {
            s->failure = SPR_ERROR_OUT_OF_MEMORY;
            return 1;
        }
        spr__set_may_add(s);
    }
    return s->options.max_seconds > 0 && delaunay_seconds(&s->options.host) > s->deadline;
}

/* Held: the surface is known to keep t below the target. Compared as float, which goals are. */
static int spr__is_held(const spr__state *s, delaunay_handle t)
{
    const float goal = spr__case_of(s, t)->goal;
    return goal > 0 && goal < (float)s->target;
}

/* How often a tetrahedron, or what it was replaced by, goes back to the first level because
 * something changed nearby. Where bad ones are dense, each success sends dozens of them back. */
static int spr__patience(const spr__state *s, delaunay_handle t)
{
    return spr__is_held(s, t) ? 3 : 16;
}

/* Whether something around one of four vertices has changed in this round or later. */
static int spr__has_changed(const spr__state *s, const uint32_t *v, uint32_t round)
{
    return s->stamp[v[0]] >= round || s->stamp[v[1]] >= round || s->stamp[v[2]] >= round ||
           s->stamp[v[3]] >= round;
}

/* Drops from the list what is no longer bad; sends what has changed since it was last tried back to
 * the first level. Returns the lowest level in the list. */
static int spr__refresh(spr__state *s)
{
    const delaunay_mesh *m = s->mesh;
    const uint8_t first = spr__level_from(s, 0);
    int lowest = SPR__HOPELESS;
    size_t i, n = 0;
    for (i = 0; i < s->bad.count; i++) {
        delaunay_handle t = s->bad.items[i];
        double goal;
        if (delaunay_is_deleted(m, t) || s->value[t] >= s->target) {
            s->at[t].listed = 0;
            continue;
        }
        s->bad.items[n++] = t;
        if (s->is_lifting && s->value[t] >= s->lift_below) continue;
        goal = (double)spr__case_of(s, t)->goal;
        if (goal > 0 && s->value[t] >= goal && !(s->thins && s->at[t].level == SPR__REMOVE))
            continue;
        if (s->at[t].level > first && s->at[t].restarts < spr__patience(s, t) &&
            spr__has_changed(s, s->mesh->tets[t].v, spr__case_of(s, t)->tried)) {
            s->at[t].level = first;
            s->at[t].restarts++;
        }
        if (s->at[t].level < lowest) lowest = s->at[t].level;
    }
    s->bad.count = n;
    return lowest;
}

/* The fraction of the progress after one more pass. How many will follow is not known: each takes a
 * tenth of what is left, so that it never falls. */
static double spr__next_shown(const spr__state *s)
{
    return s->shown + (1 - s->shown) / 10;
}

static spr_result spr__speculate(spr__state *s, delaunay_speculation *job)
{
    delaunay_result result;
    job->num_items = s->items.count;
    job->user = s;
    job->scatter = 1;
    job->phase = "improve";
    job->from = s->shown;
    job->to = s->shown = spr__next_shown(s);
    job->max_vertices = (size_t)s->first_new + s->max_new;
    result = delaunay_speculate(s->engine, job);
    s->report->rounds += job->rounds;
    s->report->plans += job->plans;
    s->report->conflicts += job->conflicts;
    return s->failure != SPR_OK ? s->failure : (spr_result)result;
}

/* Makes the table of cavities that are searched in vain, with some four entries for each bad
 * tetrahedron. Returns 0 if out of memory. */
static int spr__set_vain(spr__state *s)
{
    size_t size;
    for (s->vain_bits = 10; s->vain_bits < 22 && s->bad.count >> (s->vain_bits - 2); s->vain_bits++)
        {}
    size = (size_t)1 << s->vain_bits;
    s->vain = (uint32_t *)delaunay_alloc_zeroed(s->memory, size, sizeof *s->vain);
    return s->vain != NULL;
}

/* A limit times the effort, which is 1 for a patch. */
static uint64_t spr__by_effort(const spr__state *s, uint64_t limit)
{
    return (uint64_t)(s->effort * (double)limit);
}

/* How many plans a level may make in all. On a clean mesh no limit is reached. Where the surface
 * leaves thousands of bad tetrahedra in thin places, the expensive searches stop at a cost that
 * grows with the size of the mesh and the effort alone. So do, at any effort, the cheap operators,
 * which the worst surfaces would call a dozen times per tetrahedron: where a quality is smaller
 * than its rounding error, two flips that undo each other may both seem to gain. */
static uint64_t spr__plans_of_level(const spr__state *s, int level)
{
    const uint64_t num_tets = s->report->before.num_tets;
    if (s->is_patch && level >= SPR__LARGE) return 0;
    switch (level) {
    case SPR__REMOVE:
    case SPR__INSERT: return spr__by_effort(s, 20000 + num_tets / 10);
    case SPR__MEDIUM: return spr__by_effort(s, 5000 + num_tets / 50);
    case SPR__LARGE: return spr__by_effort(s, SPR__LARGE_PLANS + num_tets / 400);
    case SPR__UTMOST: return spr__by_effort(s, num_tets < 16000 ? 16 + num_tets / 100 : 176);
    default: return 20000 + 50 * num_tets;
    }
}

static void spr__set_allowance(spr__state *s)
{
    int level;
    for (level = 0; level < SPR__HOPELESS; level++)
        s->allowance[level] = spr__plans_of_level(s, level);
    s->refill_credit = SPR__REFILL_PATCH;
    if (!s->is_patch)
        s->refill_credit = (int64_t)spr__by_effort(
            s, SPR__REFILL_BEGIN + SPR__REFILL_EACH * s->report->before.num_tets);
}

enum { SPR__FEW = 32 }; /* of the worst, which are tried by SPR__UTMOST at a time */

/* How many tetrahedra count as the very worst. */
static size_t spr__very_worst(const spr__state *s)
{
    uint64_t n = s->report->before.num_tets;
    return n < 50000 ? (size_t)(5 + n / 1000) : 55;
}

/* Finds s->held, the quality below which a tetrahedron may be replaced by many: below it are the
 * worst of the mesh and what is hardly better, if the surface requires nothing as bad anywhere. It
 * is 0 if these are more than a few: improving some of them would not matter. */
static void spr__find_held(spr__state *s)
{
    const double worst = spr__worst_of(s, s->bad.items, s->bad.count);
    const double near_worst = spr__max(SPR__LIFTED * worst, SPR__NIL * s->target);
    size_t i, num = 0;
    if (s->lifts <= 1) s->lifted_bad = s->num_bad + spr__some(s);
    s->held = spr__min(0.5 * s->target, near_worst);
    for (i = 0; i < s->bad.count && num <= spr__some(s); i++) {
        delaunay_handle t = s->bad.items[i];
        if (!(s->value[t] < near_worst)) continue; /* nor are deleted ones */
        s->held = spr__min(s->held, spr__goal(s, t));
        num++;
    }
    if (num > spr__some(s)) s->held = 0;
}

/* How many tetrahedra at SPR__UTMOST are tried at a time. The first time these are the very worst,
 * for which a new vertex may leave more bad ones. */
static size_t spr__few(spr__state *s, size_t allowed)
{
    s->lift = s->lifts == 0 && !s->tidy && allowed > spr__very_worst(s);
    s->lifts += s->lift;
    if (!s->lift) return allowed > SPR__FEW ? (size_t)SPR__FEW : allowed;
    spr__find_held(s);
    return spr__very_worst(s);
}

static int spr__is_worse(const spr__state *s, delaunay_handle a, delaunay_handle b)
{
    return s->value[a] != s->value[b] ? s->value[a] < s->value[b] : a < b;
}

/* A heap with the best on top: moves element i down among the first n. */
static void spr__sink(const spr__state *s, delaunay_handle *t, size_t i, size_t n)
{
    delaunay_handle moving = t[i];
    size_t child;
    for (; (child = 2 * i + 1) < n; i = child) {
        if (child + 1 < n && spr__is_worse(s, t[child], t[child + 1])) child++;
        if (!spr__is_worse(s, moving, t[child])) break;
        t[i] = t[child];
    }
    t[i] = moving;
}

/* Sorts the worst first. */
static void spr__sort(const spr__state *s, delaunay_handle *t, size_t n)
{
    size_t i;
    for (i = n / 2; i-- > 0;) spr__sink(s, t, i, n);
    for (i = n; i-- > 1;) {
        delaunay_handle best = t[0];
        t[0] = t[i];
        t[i] = best;
        spr__sink(s, t, 0, i);
    }
}

/* Puts the tetrahedra of the list that have this level into s->items: only the worst of them if
 * they are too many. */
static spr_result spr__gather(spr__state *s, int level)
{
    size_t i, most;
    s->items.count = 0;
    for (i = 0; i < s->bad.count; i++) {
        delaunay_handle t = s->bad.items[i];
        if (s->at[t].level != level || (s->is_lifting && s->value[t] >= s->lift_below)) continue;
        if (delaunay_list_push(&s->items, t) != DELAUNAY_OK) return SPR_ERROR_OUT_OF_MEMORY;
    }
    most = (size_t)s->allowance[level];
    s->lift = s->is_lifting;
    if (level == SPR__UTMOST && !s->lift) most = spr__few(s, most);
    if (level == SPR__LARGE && most > SPR__LARGE_PORTION) most = SPR__LARGE_PORTION;
    if (s->items.count > most) {
        spr__sort(s, s->items.items, s->items.count);
        for (i = most; i < s->items.count && most == s->allowance[level]; i++)
            s->at[s->items.items[i]].level = SPR__GIVEN_UP;
        s->items.count = most;
    }
    s->allowance[level] -= s->items.count;
    if (level < SPR__REMOVE) { /* scanning the list is work too */
        uint64_t look = s->bad.count / 64;
        s->allowance[level] -= look < s->allowance[level] ? look : s->allowance[level];
    }
    return SPR_OK;
}

static spr_result spr__run(spr__state *s, int level)
{
    static const uint32_t batch[SPR__HOPELESS] = {1024, 512, 512, 256, 256, 128, 32, 16};
    delaunay_speculation job;
    spr_result result = spr__gather(s, level);
    if (result != SPR_OK || s->items.count == 0) return result;
    memset(&job, 0, sizeof job);
    job.plan = spr__plan;
    job.done = spr__done;
    job.batch = batch[level];
    s->sweep = level;
    s->in_flight = s->items.count < batch[level] ? s->items.count : batch[level];
    spr__set_may_add(s);
    return spr__speculate(s, &job);
}

/* Sends t back to the first level, whatever was tried before. */
static void spr__begin_again(spr__state *s, delaunay_handle t)
{
    spr__case_of(s, t)->kept = 0;
    s->at[t].level = spr__level_from(s, SPR__EDGES);
}

/* Nearly flat, for the target and for what the surface allows. */
static int spr__is_flat(const spr__state *s, delaunay_handle t)
{
    return s->value[t] < SPR__FLAT * s->target && s->value[t] < SPR__FLAT * spr__goal(s, t);
}

/* Whether t was tried in an earlier turn of lifting, and nothing around it has changed since. */
static int spr__is_lifted_in_vain(const spr__state *s, delaunay_handle t)
{
    const uint32_t lifted = spr__case_of(s, t)->lifted;
    return lifted && !spr__has_changed(s, s->mesh->tets[t].v, lifted + 1);
}

/* Puts the very worst into s->items that are nearly flat or worse than the surface requires
 * anywhere; fresh: without those that an earlier turn tried in vain. Returns 0 if out of memory. */
static int spr__find_flat(spr__state *s, int fresh)
{
    size_t i;
    s->items.count = 0;
    for (i = 0; i < s->bad.count; i++) {
        delaunay_handle t = s->bad.items[i];
        if (!(fresh && spr__is_lifted_in_vain(s, t)) &&
            (s->value[t] < s->held || spr__is_flat(s, t)) &&
            delaunay_list_push(&s->items, t) != DELAUNAY_OK)
            return 0;
    }
    spr__sort(s, s->items.items, s->items.count);
    if (s->items.count > spr__very_worst(s)) s->items.count = spr__very_worst(s);
    return 1;
}

enum {
    SPR__LIFT_PLANS = 16, /* plans added to each level for each tetrahedron that is lifted */
    SPR__LIFTS = 16       /* turns at most, as long as the last one has changed something */
};

static int spr__may_lift(const spr__state *s)
{
    return !s->is_patch && !s->tidy &&
           (s->lifts < 2 || (s->lifts <= SPR__LIFTS && s->changes != s->lifted));
}

/* Begins a turn of lifting, when nothing more can be gained: the very worst are tried at all levels
 * again, and each may now be replaced by several that are better. Returns 0 if out of memory. */
static int spr__lift(spr__state *s)
{
    size_t i;
    uint32_t more;
    int level;
    spr__find_held(s);
    s->lifts = s->lifts < 2 ? 2 : s->lifts + 1;
    s->lifted = s->changes;
    if (!spr__find_flat(s, 1)) return 0;
    if (s->items.count == 0 && !spr__find_flat(s, 0)) return 0;
    if (s->items.count == 0) return 1;
    s->is_lifting = 1;
    more = s->room_new - s->max_new;
    s->max_new += s->items.count < more ? (uint32_t)s->items.count : more;
    s->lift_below = nextafter(s->value[s->items.items[s->items.count - 1]], HUGE_VAL);
    memcpy(s->kept_allowance, s->allowance, sizeof s->allowance);
    for (level = SPR__REMOVE; level < SPR__HOPELESS; level++)
        if (s->allowance[level] < UINT64_MAX / 2)
            s->allowance[level] += SPR__LIFT_PLANS * (uint64_t)s->items.count;
    if (s->refill_credit < SPR__REFILL_LIFT) s->refill_credit = SPR__REFILL_LIFT;
    for (i = 0; i < s->items.count; i++) {
        delaunay_handle t = s->items.items[i];
        s->at[t].listed = 1;
        s->at[t].restarts = 0;
        spr__begin_again(s, t);
    }
    memset(s->stays, 0, s->cap_vertices * sizeof *s->stays);
    memset(s->still, 0, s->cap_vertices * sizeof *s->still);
    return 1;
}

enum { SPR__TIDY_SHARE = 4 }; /* of the plans that a level has, one in so many are for tidying */

/* Begins tidying, when nothing more can be gained: fewer bad tetrahedra. What went before may have
 * used up the plans. */
static void spr__tidy(spr__state *s)
{
    size_t i;
    int level;
    s->tidy = 1;
    for (level = SPR__REMOVE; level < SPR__HOPELESS && !s->is_patch; level++)
        if (s->allowance[level] < spr__plans_of_level(s, level) / SPR__TIDY_SHARE)
            s->allowance[level] = spr__plans_of_level(s, level) / SPR__TIDY_SHARE;
    for (i = 0; i < s->bad.count; i++) spr__begin_again(s, s->bad.items[i]);
    memset(s->stays, 0, s->cap_vertices * sizeof *s->stays);
}

/* Begins thinning, at the end: removes vertices without which fewer tetrahedra are bad. Between
 * walls that are close to each other these are most of the vertices. */
static void spr__thin(spr__state *s)
{
    size_t i;
    s->thins = 1;
    s->least = spr__worst_of(s, s->bad.items, s->bad.count);
    for (i = 0; i < s->bad.count; i++) s->at[s->bad.items[i]].level = SPR__REMOVE;
    memset(s->stays, 0, s->cap_vertices * sizeof *s->stays);
}

/* ---- >>shaking  several changes at once, at random ----------------------------------------
 * Where no single change gains, several at once may. The tetrahedra around a bad one, a patch, are
 * copied, the vertices of the copy are moved at random, in every second attempt beside a new one,
 * and the schedule improves the copy from this worse beginning. It replaces the patch if it has
 * fewer bad tetrahedra, if they weigh less, or if its worst quality is better. */

enum {
    SPR__PATCH_TETS = 500,
    SPR__PATCH_VERTICES = 250,
    SPR__PATCH_NEW = 3,     /* new vertices of a patch at most */
    SPR__PATCH_ROOM = 100,  /* tetrahedra by which it may grow */
    SPR__PATCH_TABLE = 1024, /* size of the hash tables of a patch: a power of 2 */
    SPR__PATCH_VAIN = 12,    /* bits of the table of cavities that were searched in vain */
    SPR__PATCHES = 16,      /* patches at a time */
    SPR__SHAKES = 3,        /* attempts at a patch, and */
    SPR__VISITS = 11,       /* patches around one tetrahedron, after the first; at most */
    SPR__VISITS_MOST = 60,  /* with more effort, for which there is room in spr__slot.shaken */
    SPR__ROUNDED = 0x40,    /* bit of spr__slot.shaken: its angles were tried */
    SPR__CLAIMED = 0x80,    /* bit of spr__slot.shaken: it is in a current patch */
    SPR__CROWD = 256,       /* limit of the number of bad ones around that is counted */
    SPR__LOOSE = 1 << 30,   /* bit of spr__around.num: the vertex or a neighbour may move */
    SPR__TIGHT = 1 << 29,   /* the same: none of them may; without both bits: not known yet */
    SPR__SHAKE_FEW = 4,     /* the worst few, shaken in any surroundings */
    SPR__HOPEFUL = 3,       /* the others only if at most one in so many around is bad */
    SPR__SPARE = 12,        /* one more bad one for so many, if a value is much better */
    SPR__SPARE_FEW = 6,     /* and so many more for the few worst, if all of them weigh less */
    SPR__SHAKE_CREDIT = 20000, /* plans in vain at most */
    SPR__SHAKE_GAIN = 1000, /* plans that a success is worth, and each bad one less */
    SPR__SHAKE_BEGIN = 40000, /* plans in all at most, besides some for each tetrahedron: */
    SPR__SHAKE_EACH = 4,
    SPR__SHAKE_PATIENCE = 12000, /* after so many plans in all, no further turn if */
    SPR__SELDOM = 24        /* not one patch in so many was improved in this one */
};

/* How far a vertex is moved at most, along each axis, as a part of the shortest edge at it. */
#define SPR__SHAKEN 0.3
/* A few more bad ones are accepted if the worst quality, or an extreme angle's measure, is better
 * by this factor. */
#define SPR__MUCH 1.1
/* If an extreme angle is much better, the bad ones may weigh up to this times what they did. */
#define SPR__HEAVIER 1.05
/* The factor by which the measure of an extreme angle must grow to be worth it. */
#define SPR__RISEN 1.02
/* Far below what the surface allows: below this part of it. */
#define SPR__FAR_BELOW 0.5
/* Attempts by one measure lift gammas to target times the measure times this: spr__patch_focus. */
#define SPR__UNHIDDEN 1.5
/* For better angles, the worst quality of a patch may fall to this part of the target, and its
 * other two measures to this. */
#define SPR__MILD 0.5

/* A patch: everything within two rings of vertices around a bad tetrahedron. */
typedef struct spr__patch {
    delaunay_handle t[SPR__PATCH_TETS + SPR__PATCH_ROOM]; /* in the end, the new ones */
    uint32_t        tets[SPR__PATCH_TETS][4];  /* their vertices as indices into v */
    uint32_t        v[SPR__PATCH_VERTICES];
    uint8_t         inner[SPR__PATCH_VERTICES]; /* it may move, and all its tetrahedra are here */
    uint16_t        tet_at[SPR__PATCH_TABLE], vertex_at[SPR__PATCH_TABLE]; /* hashed: index + 1 */
    size_t          num_tets, num_vertices, num_inner;
    uint32_t        max_new, visit, seed; /* seed: of this attempt */
    uint64_t        plans;    /* that its attempts have taken */
    uint32_t        vain[1 << SPR__PATCH_VAIN]; /* spr__state.vain, for all its attempts */
    double          before;   /* its worst quality */
    double          least;    /* lower limit of the worst quality of a result */
    double          worst;    /* worst quality of the best result: to be exceeded, or: */
    double          weight;   /* of the bad ones of the best result: to be less */
    int             num_bad, was_bad, may_add; /* bad ones: of the best result, before, to spare */
    int             few;      /* it is around one of the few worst */
    int             rounding; /* its attempts are about angles: spr__round */
    double          extreme[3], lack; /* then: the least of each measure, the sum of lacks */
    int             kind;     /* the measure with the extreme angle that it is around */
    int             focused;  /* this attempt looks at no other measure */
    double          may_be[3]; /* to what each measure may fall */
    double          all_least; /* the worst of the mesh */
    /* the best result so far: */
    int             found;
    int             no_memory; /* an attempt ran out of it */
    size_t          num_out, num_points; /* points: those of v first */
    uint32_t        out[SPR__PATCH_TETS + SPR__PATCH_ROOM][4];
    double          xyz[SPR__PATCH_VERTICES + SPR__PATCH_NEW][3];
} spr__patch;

/* Allocations of several threads, one after the other. While there are patches, the allocator of
 * the mesh, from which the workers lent to them allocate, is behind the same gate: the caller's
 * allocator must be called by one thread at a time. */
static void *spr__gate_alloc(void *user, size_t size)
{
    void *block;
    SPR__OMP(omp critical(spr__gate))
    block = delaunay_alloc((delaunay_memory *)user, size, 1);
    return block;
}
static void *spr__gate_mesh_alloc(void *user, size_t size)
{
    const delaunay_allocator *of_mesh = (const delaunay_allocator *)user;
    void *block;
    SPR__OMP(omp critical(spr__gate))
    block = of_mesh->alloc(of_mesh->user, size);
    return block;
}
static void spr__gate_mesh_release(void *user, void *block)
{
    const delaunay_allocator *of_mesh = (const delaunay_allocator *)user;
    SPR__OMP(omp critical(spr__gate))
    of_mesh->release(of_mesh->user, block);
}

/* The allocator of the patches of a thread. Attempts at patches need much the same blocks again and
 * again: those that are released are kept for the next attempt, by powers of two. */
enum { SPR__POOL_LEAST = 64, SPR__POOL_SIZES = 31 };
typedef union spr__spare {
    struct {
        union spr__spare *next; /* of the same size */
        size_t size;            /* number of the size: SPR__POOL_LEAST << size bytes */
    } as;
    double align[2];
} spr__spare;
typedef struct spr__pool {
    delaunay_memory *memory;
    spr__spare *spare[SPR__POOL_SIZES];
} spr__pool;

static void *spr__pool_alloc(void *user, size_t bytes)
{
    spr__pool *pool = (spr__pool *)user;
    spr__spare *block;
    size_t size = 0, room = SPR__POOL_LEAST;
    if (bytes > SIZE_MAX / 4) return NULL;
    for (; room < bytes + sizeof *block; room *= 2) size++;
    if (size >= SPR__POOL_SIZES) return NULL;
    block = pool->spare[size];
    if (block) pool->spare[size] = block->as.next;
    else block = (spr__spare *)spr__gate_alloc(pool->memory, room);
    if (!block) return NULL;
    block->as.size = size;
    return block + 1;
}
static void spr__pool_release(void *user, void *memory)
{
    spr__pool *pool = (spr__pool *)user;
    spr__spare *block = (spr__spare *)memory - 1;
    block->as.next = pool->spare[block->as.size];
    pool->spare[block->as.size] = block;
}

/* Makes a pool for each of the threads. Returns 0 without memory. */
static int spr__pools_init(spr__state *s, size_t threads)
{
    spr__pool *pools;
    if (threads <= s->num_pools) return 1;
    pools = (spr__pool *)delaunay_grow_zeroed(s->memory, s->pools, s->num_pools, threads,
                                              sizeof *pools);
    if (!pools) return 0;
    for (s->pools = pools; s->num_pools < threads; s->num_pools++)
        pools[s->num_pools].memory = s->memory;
    return 1;
}

static void spr__pools_free(spr__state *s)
{
    size_t i, k;
    for (i = 0; i < s->num_pools; i++)
        for (k = 0; k < SPR__POOL_SIZES; k++)
            while (s->pools[i].spare[k]) {
                spr__spare *block = s->pools[i].spare[k];
                s->pools[i].spare[k] = block->as.next;
                delaunay_release(s->memory, block);
            }
    delaunay_release(s->memory, s->pools);
}

static uint32_t spr__patch_hash(uint64_t key)
{
    return (uint32_t)((key * UINT64_C(0x9E3779B97F4A7C15)) >> 32) & (SPR__PATCH_TABLE - 1);
}

/* The index of v in a patch, to which it is added if it is not there. Returns SPR__PATCH_VERTICES
 * if there is no room. */
static uint32_t spr__patch_vertex(spr__patch *p, uint32_t v)
{
    uint32_t at = spr__patch_hash(v), i;
    for (; (i = p->vertex_at[at]) != 0; at = (at + 1) & (SPR__PATCH_TABLE - 1))
        if (p->v[i - 1] == v) return i - 1;
    i = (uint32_t)p->num_vertices;
    if (i == SPR__PATCH_VERTICES) return i;
    p->inner[i] = 0;
    p->v[p->num_vertices++] = v;
    p->vertex_at[at] = (uint16_t)(i + 1);
    return i;
}

/* Where t is in the table of a patch, or where it would be. */
static uint16_t *spr__patch_slot(spr__patch *p, delaunay_handle t)
{
    uint32_t at = spr__patch_hash(t);
    while (p->tet_at[at] != 0 && p->t[p->tet_at[at] - 1] != t)
        at = (at + 1) & (SPR__PATCH_TABLE - 1);
    return &p->tet_at[at];
}

/* Adds the tetrahedra around v that are in the region of tetrahedron of. Returns 1; 0 if there is
 * no room, if more than max_bad are bad, or if one of them is in another patch; or an error. */
static int spr__patch_add_star(const spr__state *s, delaunay_worker *worker, spr__patch *p,
                               uint32_t v, delaunay_handle of, int max_bad, delaunay_list *star)
{
    const delaunay_mesh *m = s->mesh;
    delaunay_result result = delaunay_vertex_star(m, worker, v, star);
    size_t i;
    int k;
    if (result != DELAUNAY_OK) return (int)result;
    for (i = 0; i < star->count; i++) {
        delaunay_handle t = star->items[i];
        uint16_t *slot = spr__patch_slot(p, t);
        if (*slot != 0 || !spr__is_inside(m, t)) continue;
        if (m->color && m->color[t] != m->color[of]) continue;
        if (p->num_tets == SPR__PATCH_TETS || (s->at[t].shaken & SPR__CLAIMED)) return 0;
        p->num_bad += s->value[t] < s->target;
        if (p->num_bad > max_bad) return 0;
        for (k = 0; k < 4; k++) {
            p->tets[p->num_tets][k] = spr__patch_vertex(p, m->tets[t].v[k]);
            if (p->tets[p->num_tets][k] == SPR__PATCH_VERTICES) return 0;
        }
        p->t[p->num_tets++] = t;
        *slot = (uint16_t)p->num_tets;
    }
    return 1;
}

/* How many tetrahedra of a patch may be bad if at most one in so many may; 0: any number. */
static uint32_t spr__patch_max_bad(int one_in)
{
    return (uint32_t)SPR__PATCH_TETS / (uint32_t)(one_in ? one_in : 1);
}

/* Makes the patch around t: the stars of all vertices of the stars of the vertices of t. one_in: at
 * most one tetrahedron in so many may be bad, or 0. Returns 1; 0 if it is not to be shaken; or an
 * error. */
static int spr__patch_set(const spr__state *s, delaunay_worker *worker, spr__patch *p,
                          delaunay_handle t, int one_in, delaunay_list *star)
{
    int answer = 1, max_bad = (int)spr__patch_max_bad(one_in), k;
    spr__burden was;
    size_t i, ring;
    p->num_tets = p->num_inner = p->num_vertices = 0;
    p->num_bad = p->found = p->no_memory = 0;
    p->plans = 0;
    memset(p->tet_at, 0, sizeof p->tet_at);
    memset(p->vertex_at, 0, sizeof p->vertex_at);
    for (k = 0; k < 4; k++) (void)spr__patch_vertex(p, s->mesh->tets[t].v[k]);
    for (i = 0, ring = 4; i < ring && answer > 0; i++) {
        answer = spr__patch_add_star(s, worker, p, p->v[i], t, max_bad, star);
        p->inner[i] = s->movable[p->v[i]];
        p->num_inner += p->inner[i];
        if (i == 3) ring = p->num_vertices;
    }
    if (answer <= 0 || p->num_inner == 0) return answer < 0 ? answer : 0;
    if (one_in && (size_t)one_in * (size_t)p->num_bad > p->num_tets) return 0;
    was = spr__burden_of(s, p->t, p->num_tets);
    p->before = spr__worst_of(s, p->t, p->num_tets);
    p->least = spr__min(p->before, spr__max(s->least, SPR__MILD * s->target));
    p->all_least = s->least;
    p->worst = spr__floor(s, p->before);
    p->was_bad = was.num;
    p->may_add = was.num / SPR__SPARE;
    p->weight = was.weight;
    p->rounding = p->few = 0;
    return 1;
}

/* Lowers least to the three measures of t, and adds to lack the squares of what they are below 1.
 */
static void spr__add_extremes(const delaunay_mesh *m, delaunay_handle t, double *least,
                              double *lack)
{
    const uint32_t *v = m->tets[t].v;
    double e[3];
    int k;
    spr__extremes(spr__point(m, v[0]), spr__point(m, v[1]), spr__point(m, v[2]),
                  spr__point(m, v[3]), e);
    for (k = 0; k < 3; k++) {
        least[k] = spr__min(least[k], e[k]);
        if (e[k] < 1) *lack += (1 - e[k]) * (1 - e[k]);
    }
}

/* A random number between -1 and 1. */
static double spr__random(uint64_t *state)
{
    uint64_t x = *state += UINT64_C(0x9E3779B97F4A7C15);
    x = (x ^ (x >> 30)) * UINT64_C(0xBF58476D1CE4E5B9);
    x = (x ^ (x >> 27)) * UINT64_C(0x94D049BB133111EB);
    x ^= x >> 31;
    return (double)(x >> 11) / 4503599627370496.0 - 1;
}

/* Inserts a vertex at the centroid of one of the bad tetrahedra of a patch's own mesh, unless
 * rounding leaves no room there. Returns 0 if out of memory. */
static int spr__patch_sow(const spr__state *s, const spr__patch *p, delaunay_mesh *m,
                          delaunay_worker *worker)
{
    uint64_t state = ~(uint64_t)p->seed;
    int which = (int)(0.5 * (1 + spr__random(&state)) * p->was_bad), k, j;
    const double *corner[4];
    double x[3];
    uint32_t v[4][4], added;
    delaunay_handle t = 0;
    size_t i;
    for (i = 0; i < p->num_tets && t == 0; i++)
        if (s->value[p->t[i]] < s->target && which-- == 0) t = (delaunay_handle)i + 1;
    if (t == 0) return 1;
    spr__middle(m, t, x);
    for (k = 0; k < 4; k++) {
        for (j = 0; j < 4; j++) corner[j] = j == k ? x : spr__point(m, m->tets[t].v[j]);
        if (!(delaunay_orient3d(corner[0], corner[1], corner[2], corner[3]) > 0)) return 1;
    }
    added = delaunay_add_vertex(m, x, DELAUNAY_NO_ID);
    for (k = 0; k < 4; k++) {
        memcpy(v[k], m->tets[t].v, sizeof v[k]);
        v[k][k] = added;
    }
    return added && delaunay_replace(m, worker, &t, 1, v[0], 4, NULL) == DELAUNAY_OK;
}

/* Moves the vertices of a patch's own mesh that are inner or new at random, one by one; a move that
 * inverts a tetrahedron is undone. */
static void spr__patch_jolt(const spr__patch *p, delaunay_mesh *m)
{
    uint64_t state = p->seed;
    delaunay_handle t;
    uint32_t v;
    int k;
    for (v = 1; v < m->num_vertices; v++) {
        double *x = m->vertices[v].x, old[3], shortest = HUGE_VAL;
        if (v <= p->num_vertices && !p->inner[v - 1]) continue;
        memcpy(old, x, sizeof old);
        for (t = 1; t < m->num_tets; t++) {
            const uint32_t *corner = m->tets[t].v;
            if (delaunay_local_index(&m->tets[t], v) < 0) continue;
            for (k = 0; k < 4; k++)
                if (corner[k] != v)
                    shortest = spr__min(shortest, spr__distance2(x, spr__point(m, corner[k])));
        }
        shortest = sqrt(shortest);
        for (k = 0; k < 3; k++) x[k] += SPR__SHAKEN * shortest * spr__random(&state);
        for (t = 1; t < m->num_tets; t++) {
            if (delaunay_local_index(&m->tets[t], v) < 0) continue;
            if (spr__all_positive(m, &m->tets[t].v, 1)) continue;
            memcpy(x, old, sizeof old);
            break;
        }
    }
}

/* Makes a mesh of its own from a patch, with the constraint marks of the whole mesh. */
static delaunay_result spr__patch_mesh(const spr__state *s, const spr__patch *p,
                                       const delaunay_host *host, delaunay_mesh *own)
{
    const delaunay_mesh *m = s->mesh;
    double xyz[SPR__PATCH_VERTICES][3];
    delaunay_result result;
    size_t i;
    for (i = 0; i < p->num_vertices; i++) memcpy(xyz[i], spr__point(m, p->v[i]), sizeof xyz[i]);
    result =
        delaunay_import(own, xyz[0], p->num_vertices, p->tets[0], NULL, p->num_tets, host, NULL);
    if (result == DELAUNAY_OK) result = delaunay_enable_marks(own);
    if (result != DELAUNAY_OK) return result;
    for (i = 0; i < p->num_tets; i++) {
        own->color[i + 1] = 1;
        if (m->flags)
            own->flags[i + 1] =
                (uint16_t)(m->flags[p->t[i]] & (DELAUNAY_FACET_BITS | DELAUNAY_EDGE_BITS));
    }
    return DELAUNAY_OK;
}

/* Whether a result may have num bad ones. much: something is much better, for which a few more are
 * accepted; light: and they weigh less in all, for which some more are accepted around the few
 * worst. */
static int spr__patch_may_have(const spr__patch *p, int num, int much, int light)
{
    int more = p->may_add + (p->few && light ? SPR__SPARE_FEW : 0);
    return num <= p->num_bad || (much && num <= p->was_bad + more);
}

/* Whether the angles of a result are less extreme: all in all, or, around the most extreme of the
 * mesh, that one. */
static int spr__patch_is_rounder(const spr__patch *p, spr__burden is, double worst,
                                 const double *extreme, double lack)
{
    double was = p->extreme[p->kind], here = extreme[p->kind];
    int k, much = here > SPR__MUCH * was,
           light = is.weight < (much ? SPR__HEAVIER : SPR__MORE) * p->weight;
    if (worst < (p->few && light ? p->all_least : p->least)) return 0;
    for (k = 0; k < 3; k++)
        if (extreme[k] < (k == p->kind ? was : p->may_be[k])) return 0;
    if (!spr__patch_may_have(p, is.num, much, light)) return 0;
    return lack < 0.98 * p->lack || (p->few && light && here > SPR__RISEN * was);
}

/* Whether a result has fewer bad ones, or they weigh less, or its worst is better. */
static int spr__patch_is_better(const spr__patch *p, spr__burden is, double worst)
{
    int light = is.weight < SPR__LIGHTER * p->weight;
    if (worst < (light ? p->all_least : p->least)) return 0;
    if (!spr__patch_may_have(p, is.num, worst > SPR__MUCH * p->worst, light)) return 0;
    return light || worst > p->worst || (is.num < p->num_bad && worst >= p->before);
}

/* Keeps the improved mesh of a patch if it is the best so far. */
static void spr__patch_judge(spr__patch *p, const spr__state *own)
{
    const delaunay_mesh *m = own->mesh;
    delaunay_handle t;
    double worst = HUGE_VAL, extreme[3] = {4, 4, 4}, lack = 0;
    spr__burden is = {0, 0};
    size_t num = 0;
    uint32_t v;
    int k;
    for (t = 1; t < m->num_tets; t++) {
        double value = own->value[t];
        if (delaunay_is_deleted(m, t)) continue;
        if (p->rounding) {
            const uint32_t *x = m->tets[t].v;
            value = spr_gamma(spr__point(m, x[0]), spr__point(m, x[1]), spr__point(m, x[2]),
                              spr__point(m, x[3]));
            spr__add_extremes(m, t, extreme, &lack);
        }
        worst = spr__min(worst, value);
        spr__burden_add(own, &is, value);
        num++;
    }
    if (!(p->rounding ? spr__patch_is_rounder(p, is, worst, extreme, lack)
                      : spr__patch_is_better(p, is, worst)) ||
        num > SPR__PATCH_TETS + SPR__PATCH_ROOM ||
        m->num_vertices - 1 > p->num_vertices + SPR__PATCH_NEW)
        return;
    p->found = 1;
    p->num_bad = is.num;
    p->weight = is.weight;
    p->worst = spr__max(p->worst, worst);
    p->lack = lack;
    memcpy(p->extreme, extreme, sizeof extreme);
    p->num_points = m->num_vertices - 1;
    p->num_out = 0;
    for (v = 1; v < m->num_vertices; v++)
        memcpy(p->xyz[v - 1], m->vertices[v].x, sizeof p->xyz[0]);
    for (t = 1; t < m->num_tets; t++) {
        if (delaunay_is_deleted(m, t)) continue;
        for (k = 0; k < 4; k++) p->out[p->num_out][k] = m->tets[t].v[k] - 1;
        p->num_out++;
    }
}

static spr_result spr__improve_patch(spr__state *s, uint32_t max_new);
static void spr__close(spr__state *s);

/* How many bad ones an attempt may have to be tidied, if num_bad must not be exceeded after that:
 * tidying takes most of the time and seldom removes more than a few. Attempts about angles do
 * without. */
static uint64_t spr__within_reach(int num_bad)
{
    return (uint64_t)num_bad + (uint64_t)num_bad / 32 + 1;
}

/* Sets what an attempt about angles looks at: all three measures; or one, and then low gammas are
 * lifted, so that a tetrahedron that the surface holds anyway does not hide an extreme angle beside
 * it. */
static void spr__patch_focus(const spr__patch *p, double target, spr__focus *f)
{
    double lift = SPR__UNHIDDEN * target * p->extreme[p->kind];
    int k;
    memset(f, 0, sizeof *f);
    f->target = target;
    for (k = 0; k < 3 && p->focused; k++)
        if (k != p->kind) f->spare[k] = 8;
    if (!p->focused || !(lift > p->before)) return;
    f->low = p->before;
    f->lift = lift;
}

/* The options of an attempt at a patch: alone with its memory and with a mask of fixed vertices. */
static spr_options spr__patch_options(const spr__state *s, const uint8_t *fixed)
{
    spr_options o = s->options;
    memset(&o.host, 0, sizeof o.host);
    o.host.allocator.alloc = spr__pool_alloc;
    o.host.allocator.release = spr__pool_release;
    o.host.allocator.user = &s->pools[SPR__THREAD()];
    o.host.num_threads = 1;
    o.max_rounds = 0;
    o.free_vertices = 1;
    o.fixed_vertices = fixed;
    o.left = NULL;
    return o;
}

/* One attempt at a patch, by one thread, with data of its own except for a worker of the mesh's
 * engine; s and the mesh are only read. */
static void spr__patch_try(const spr__state *s, spr__patch *p)
{
    spr__state own;
    spr_report report;
    delaunay_mesh mesh;
    delaunay_memory memory;
    uint8_t fixed[SPR__PATCH_VERTICES + 2]; /* by vertex; the last is for the new one */
    const int sows = !p->rounding && p->max_new > 0 && p->seed % 2 == 1;
    delaunay_result result;
    size_t i;
    memset(&own, 0, sizeof own);
    memset(&report, 0, sizeof report);
    memset(&mesh, 0, sizeof mesh);
    for (fixed[0] = 1, i = 0; i < p->num_vertices; i++) fixed[i + 1] = !p->inner[i];
    fixed[p->num_vertices + 1] = 0;
    own.options = spr__patch_options(s, fixed);
    own.quality = s->quality;
    own.quality_user = s->quality_user;
    own.target = s->target;
    own.effort = 1;
    own.gamma = s->gamma && !p->rounding;
    own.rounding = p->rounding;
    own.simd = s->simd;
    if (p->rounding) {
        own.quality = spr__measure_all;
        own.quality_user = &own.focus;
        spr__patch_focus(p, s->target, &own.focus);
    }
    own.is_patch = own.lifts = 1;
    own.lent = delaunay_engine_worker(s->engine, SPR__THREAD());
    own.vain = p->vain;
    own.vain_bits = SPR__PATCH_VAIN;
    own.tidy_below = p->rounding ? 0 : spr__within_reach(p->num_bad);
    own.mesh = &mesh;
    own.report = &report;
    own.memory = &memory;
    result = delaunay_memory_init(&memory, &own.options.host);
    if (result == DELAUNAY_OK) result = spr__patch_mesh(s, p, &own.options.host, &mesh);
    if (result == DELAUNAY_OK && sows && !spr__patch_sow(s, p, &mesh, own.lent))
        result = DELAUNAY_ERROR_OUT_OF_MEMORY;
    if (result == DELAUNAY_OK) {
        const uint32_t sown = mesh.num_vertices - 1 - (uint32_t)p->num_vertices;
        if (!p->rounding || p->seed > 1) spr__patch_jolt(p, &mesh);
        result = (delaunay_result)spr__improve_patch(&own, p->max_new - sown);
        if (result == DELAUNAY_OK) spr__patch_judge(p, &own);
        p->plans += report.plans;
        spr__close(&own);
    }
    p->no_memory |= result == DELAUNAY_ERROR_OUT_OF_MEMORY;
    delaunay_mesh_free(&mesh);
}

/* Makes attempts at a patch, until two have taken the same number of plans: then there is hardly
 * anything that can move. If it is about angles, every second attempt looks at the extreme measure
 * alone. */
static void spr__patch_shake(const spr__state *s, spr__patch *p)
{
    uint64_t plans, last[2] = {UINT64_MAX, UINT64_MAX};
    int i, n = p->rounding && p->few ? 2 * SPR__SHAKES : SPR__SHAKES;
    memset(p->vain, 0, sizeof p->vain);
    for (i = 0; i < n && !p->no_memory && (p->rounding ? p->lack > 0 : p->num_bad > 0); i++) {
        p->seed = p->visit * SPR__SHAKES + (uint32_t)i;
        p->focused = p->rounding && i % 2 == 1;
        if (p->rounding) memset(p->vain, 0, sizeof p->vain);
        plans = p->plans;
        spr__patch_try(s, p);
        if (p->plans - plans == last[p->focused]) break;
        if (i == 1 && !p->found && SPR__HOPEFUL * (size_t)p->was_bad > p->num_tets) break;
        last[p->focused] = p->plans - plans;
    }
}

/* How many points of a patch are in no tetrahedron of its best result. */
static uint64_t spr__patch_gone(const spr__patch *p)
{
    uint8_t stays[SPR__PATCH_VERTICES + SPR__PATCH_NEW] = {0};
    uint64_t gone = p->num_points;
    size_t i;
    int k;
    for (i = 0; i < p->num_out; i++)
        for (k = 0; k < 4; k++) {
            gone -= !stays[p->out[i][k]];
            stays[p->out[i][k]] = 1;
        }
    return gone;
}

/* Puts the best result of a patch in its place. */
static spr_result spr__patch_commit(spr__state *s, spr__patch *p)
{
    delaunay_mesh *m = s->mesh;
    delaunay_handle slots[SPR__PATCH_TETS + SPR__PATCH_ROOM];
    uint32_t *out = p->out[0], v[SPR__PATCH_VERTICES + SPR__PATCH_NEW];
    const uint64_t gone = spr__patch_gone(p);
    delaunay_result result;
    size_t i;
    memcpy(v, p->v, p->num_vertices * sizeof *v);
    for (i = p->num_vertices; i < p->num_points; i++) {
        v[i] = delaunay_add_vertex(m, p->xyz[i], DELAUNAY_NO_ID);
        if (v[i] == 0) return SPR_ERROR_OUT_OF_MEMORY;
        s->report->vertices_inserted++;
    }
    for (i = 0; i < 4 * p->num_out; i++) out[i] = v[out[i]];
    if (!spr__fit(s)) return SPR_ERROR_OUT_OF_MEMORY;
    result = delaunay_replace(m, delaunay_engine_worker(s->engine, 0), p->t, p->num_tets, out,
                              p->num_out, slots);
    if (result != DELAUNAY_OK) return (spr_result)result;
    for (i = 0; i < p->num_vertices; i++)
        if (p->inner[i]) memcpy(m->vertices[v[i]].x, p->xyz[i], sizeof p->xyz[i]);
    if (!spr__fit(s)) return SPR_ERROR_OUT_OF_MEMORY;
    for (i = 0; i < p->num_tets; i++) {
        spr__set_value(s, p->t[i], HUGE_VAL);
        if (delaunay_engine_touch(s->engine, p->t[i]) != DELAUNAY_OK)
            return SPR_ERROR_OUT_OF_MEMORY;
    }
    for (i = 0; i < p->num_out; i++) {
        p->t[i] = slots[i];
        s->at[slots[i]].restarts = 0;
        if (!spr__renew(s, slots[i], 1) ||
            delaunay_engine_touch(s->engine, slots[i]) != DELAUNAY_OK)
            return SPR_ERROR_OUT_OF_MEMORY;
    }
    p->num_tets = p->num_out;
    s->report->vertices_removed += gone;
    s->report->shaken++;
    return SPR_OK;
}

/* Whether t is worth shaking: bad, and not held by the surface, or far below what that allows. */
static int spr__is_shakable(const spr__state *s, delaunay_handle t)
{
    const float held = spr__case_of(s, t)->goal;
    const double goal = (double)held;
    return !delaunay_is_deleted(s->mesh, t) && s->value[t] < s->target &&
           s->at[t].shaken < s->visits &&
           (held >= (float)s->target || s->value[t] < SPR__FAR_BELOW * goal);
}

/* What was around each vertex when the list of what is to be shaken was made. */
typedef struct spr__around {
    uint32_t *num;          /* by vertex: bad ones; and the bits SPR__LOOSE or SPR__TIGHT */
    uint32_t  num_vertices; /* at that time */
} spr__around;

/* How many bad ones are around the vertices of t; one that has several of them counts several
 * times. */
static size_t spr__num_around(const spr__state *s, const uint32_t *around, delaunay_handle t)
{
    const uint32_t *v = s->mesh->tets[t].v;
    size_t num = 0;
    int k;
    for (k = 0; k < 4; k++) num += around[v[k]] & (SPR__TIGHT - 1);
    return num < SPR__CROWD ? num : SPR__CROWD - 1;
}

static int spr__is_fixed(const spr__state *s, delaunay_handle t)
{
    const uint32_t *v = s->mesh->tets[t].v;
    return !s->movable[v[0]] && !s->movable[v[1]] && !s->movable[v[2]] && !s->movable[v[3]];
}

/* Whether v or a neighbour may move, which is found out once; or an error. */
static int spr__is_loose(const spr__state *s, spr__around *around, uint32_t v, delaunay_list *star)
{
    const delaunay_mesh *m = s->mesh;
    uint32_t *num = &around->num[v];
    delaunay_result result;
    size_t i;
    if (*num & SPR__TIGHT) return 0;
    if (*num & SPR__LOOSE) return 1;
    result = delaunay_vertex_star(m, delaunay_engine_worker(s->engine, 0), v, star);
    if (result != DELAUNAY_OK) return (int)result;
    for (i = 0; i < star->count; i++)
        if (spr__is_inside(m, star->items[i]) && !spr__is_fixed(s, star->items[i])) break;
    *num |= i < star->count ? SPR__LOOSE : SPR__TIGHT;
    return i < star->count;
}

/* Whether a patch around t can have no more than max_bad bad ones, and a vertex that may move, by
 * what was around the vertices of t; or an error. */
static int spr__patch_may_do(const spr__state *s, spr__around *around, delaunay_handle t,
                             uint32_t max_bad, delaunay_list *star)
{
    const uint32_t *v = s->mesh->tets[t].v;
    int k, loose = !spr__is_fixed(s, t);
    for (k = 0; k < 4; k++) {
        if (v[k] >= around->num_vertices) return 1; /* a new vertex: not known */
        if ((around->num[v[k]] & (SPR__TIGHT - 1)) > max_bad) return 0;
    }
    for (k = 0; k < 4 && loose == 0; k++) loose = spr__is_loose(s, around, v[k], star);
    return loose;
}

/* Sorts s->items, from first on, by the number of bad ones around, otherwise in the same order.
 * Returns 0 if out of memory. */
static int spr__sort_by_crowd(spr__state *s, const uint32_t *around, size_t first)
{
    size_t place[SPR__CROWD + 1] = {0}, n = s->items.count, i;
    delaunay_handle *t = s->items.items,
                    *old = (delaunay_handle *)delaunay_alloc(s->memory, n + 1, sizeof *old);
    if (!old) return 0;
    for (i = first; i < n; i++) {
        old[i] = t[i];
        place[spr__num_around(s, around, t[i]) + 1]++;
    }
    for (place[0] = first, i = 0; i < SPR__CROWD; i++) place[i + 1] += place[i];
    for (i = first; i < n; i++) t[place[spr__num_around(s, around, old[i])]++] = old[i];
    delaunay_release(s->memory, old);
    return 1;
}

/* Puts into s->items what is to be shaken: first the few worst, then those with the fewest bad ones
 * around, which take the least time and are improved most often. Returns 0 if out of memory. */
static int spr__find_shakable(spr__state *s, spr__around *around)
{
    size_t i;
    int k, ok = 1;
    around->num_vertices = s->mesh->num_vertices;
    around->num = (uint32_t *)delaunay_alloc_zeroed(s->memory, around->num_vertices,
                                                    sizeof *around->num);
    if (!around->num) return 0;
    for (s->items.count = i = 0; i < s->bad.count && ok; i++) {
        delaunay_handle t = s->bad.items[i];
        if (delaunay_is_deleted(s->mesh, t) || !(s->value[t] < s->target)) continue;
        for (k = 0; k < 4; k++) around->num[s->mesh->tets[t].v[k]]++;
        if (spr__is_shakable(s, t)) ok = delaunay_list_push(&s->items, t) == DELAUNAY_OK;
    }
    if (!ok) return 0;
    spr__sort(s, s->items.items, s->items.count);
    return spr__sort_by_crowd(s, around->num, SPR__SHAKE_FEW);
}

/* How many vertices may still be added. */
static uint32_t spr__new_left(const spr__state *s)
{
    uint32_t added = s->mesh->num_vertices - s->first_new;
    return s->max_new > added ? s->max_new - added : 0;
}

/* Makes the next patches, at most `most`, which do not overlap: what would overlap waits for
 * another pass. The first `few` may be in any surroundings. Returns their number, or an error. */
static int spr__patches_set(spr__state *s, spr__patch *patch, spr__around *around,
                            delaunay_list *star, int few, int most)
{
    uint32_t left = spr__new_left(s), new_ = SPR__PATCH_NEW;
    size_t i, j;
    int num = 0, answer;
    for (i = 0; i < s->items.count && num < most; i++) {
        delaunay_handle t = s->items.items[i];
        int one_in = few > 0 ? 0 : SPR__HOPEFUL;
        if (!spr__is_shakable(s, t)) continue; /* or it is in a patch already */
        answer = spr__patch_may_do(s, around, t, spr__patch_max_bad(one_in), star);
        if (answer > 0)
            answer = spr__patch_set(s, delaunay_engine_worker(s->engine, 0), &patch[num], t, one_in,
                                    star);
        if (answer < 0) return answer;
        patch[num].visit = s->at[t].shaken++;
        if (answer == 0) continue;
        patch[num].few = few-- > 0;
        patch[num].max_new = left < new_ ? left : new_;
        left -= patch[num].max_new;
        for (j = 0; j < patch[num].num_tets; j++)
            s->at[patch[num].t[j]].shaken |= SPR__CLAIMED;
        num++;
    }
    s->items.count -= i;
    if (i && s->items.count)
        memmove(s->items.items, s->items.items + i, s->items.count * sizeof *s->items.items);
    return num;
}

/* What the number of bad ones must not exceed: that at the start, or the present one if it is
 * larger. */
static uint64_t spr__max_bad(const spr__state *s)
{
    return s->report->before.num_below > s->num_bad ? s->report->before.num_below : s->num_bad;
}

/* Shakes these patches in parallel, and puts results in place where they are better. Returns how
 * many are, or an error. */
static int spr__patches_shake(spr__state *s, spr__patch *patch, int num)
{
    int threads = delaunay_threads_for(&s->options.host, SIZE_MAX), found = 0, i;
    delaunay_allocator *allocator = &s->mesh->memory.allocator, of_mesh = *allocator;
    size_t k;
    if (!spr__pools_init(s, (size_t)threads)) return SPR_ERROR_OUT_OF_MEMORY;
    allocator->alloc = spr__gate_mesh_alloc;
    allocator->release = spr__gate_mesh_release;
    allocator->user = &of_mesh;
    /* each thread writes its patches; the mesh is read */
    SPR__OMP(omp parallel for schedule(dynamic, 1) num_threads(threads))
    for (i = 0; i < num; i++) spr__patch_shake(s, &patch[i]);
    *allocator = of_mesh;
    for (i = 0; i < num; i++)
        if (patch[i].no_memory) return SPR_ERROR_OUT_OF_MEMORY;
    for (i = 0; i < num; i++) {
        spr_result result;
        for (k = 0; k < patch[i].num_tets; k++) s->at[patch[i].t[k]].shaken &= SPR__CLAIMED - 1;
        s->shakes += patch[i].plans;
        s->shake_credit -= (int64_t)patch[i].plans;
        if (!patch[i].found || s->num_bad + (uint64_t)patch[i].num_bad >
                                   spr__max_bad(s) + (uint64_t)patch[i].was_bad)
            continue;
        found++;
        s->shake_credit += SPR__SHAKE_GAIN * (1 + patch[i].was_bad - patch[i].num_bad);
        result = spr__patch_commit(s, &patch[i]);
        if (result != SPR_OK) return (int)result;
    }
    return found;
}

static int64_t spr__most_credit(const spr__state *s)
{
    uint64_t most = 4000 + s->report->before.num_tets / 2;
    if (most > SPR__SHAKE_CREDIT) most = SPR__SHAKE_CREDIT;
    return (int64_t)spr__by_effort(s, most);
}

/* Whether to end: shaking has taken all the plans it may, or seldom helps. Each plan costs credit,
 * each success adds some, and there is never more than at the start. */
static int spr__has_shaken_enough(spr__state *s)
{
    uint64_t most_plans =
        spr__by_effort(s, SPR__SHAKE_BEGIN + SPR__SHAKE_EACH * s->report->before.num_tets);
    int64_t most = spr__most_credit(s);
    if (s->shakes == 0 || s->shake_credit > most) s->shake_credit = most;
    return s->shake_credit <= 0 || s->shakes > most_plans;
}

/* After the few worst, whose surroundings may be mostly bad, at least half of the credit is left to
 * the others. */
static void spr__spare_credit(spr__state *s)
{
    int64_t half = spr__most_credit(s) / 2;
    if (s->shake_credit < half) s->shake_credit = half;
}

/* For how many patches the credit is enough, if `tried` patches took so many plans. */
static int spr__max_patches(const spr__state *s, int tried, uint64_t plans)
{
    int64_t each = tried ? (int64_t)plans / tried + 1 : 1, most;
    if (tried == 0) return SPR__SHAKE_FEW;
    most = 1 + (s->shake_credit > 0 ? s->shake_credit : 0) / each;
    return most < SPR__PATCHES ? (int)most : (int)SPR__PATCHES;
}

/* Reports progress. Returns SPR_OK, or why the call ends. */
static spr_result spr__look_up(const spr__state *s)
{
    const delaunay_host *host = &s->options.host;
    if (host->progress && host->progress(host->user, "improve", s->shown)) return SPR_CANCELLED;
    if (!(s->options.max_seconds > 0) || delaunay_seconds(host) <= s->deadline) return SPR_OK;
    return SPR_STOPPED_BY_BUDGET;
}

/* Shakes around what is left, once. Returns SPR_OK; SPR_GOAL_NOT_MET if it is not worth doing
 * again; or why the call ends. */
static spr_result spr__shake(spr__state *s)
{
    spr__patch *patch = (spr__patch *)delaunay_alloc(s->memory, SPR__PATCHES, sizeof *patch);
    spr__around around = {NULL, 0};
    spr_result result = patch ? SPR_OK : SPR_ERROR_OUT_OF_MEMORY;
    delaunay_list list;
    uint64_t begun = s->shakes;
    int tried = 0, found = 0, num = 1, answer;
    memset(&list, 0, sizeof list);
    list.memory = s->memory;
    s->least = spr__worst_of(s, s->bad.items, s->bad.count);
    s->visits = 1 + (int)spr__min(s->effort * (double)SPR__VISITS, (double)SPR__VISITS_MOST);
    if (result == SPR_OK && !spr__find_shakable(s, &around)) result = SPR_ERROR_OUT_OF_MEMORY;
    while (result == SPR_OK && num > 0 && !spr__has_shaken_enough(s)) {
        num = spr__patches_set(s, patch, &around, &list, tried == 0 ? SPR__SHAKE_FEW : 0,
                               spr__max_patches(s, tried, s->shakes - begun));
        answer = num > 0 ? spr__patches_shake(s, patch, num) : num;
        if (answer < 0) result = (spr_result)answer;
        if (tried == 0) spr__spare_credit(s);
        tried += num;
        found += answer;
        if (result == SPR_OK) result = spr__look_up(s);
    }
    delaunay_list_free(&list);
    delaunay_release(s->memory, around.num);
    delaunay_release(s->memory, patch);
    if (result != SPR_OK || spr__by_effort(s, SPR__SELDOM * (uint64_t)found) > (uint64_t)tried ||
        (tried > 0 && s->shakes < spr__by_effort(s, SPR__SHAKE_PATIENCE)))
        return result;
    return SPR_GOAL_NOT_MET;
}

/* ---- >>stages  the whole schedule --------------------------------------------------------- */

/* -- extreme angles: patches around them are improved by spr__measure_all */

enum {
    SPR__EXTREME = 8, /* worst tetrahedra by each of the three measures */
    SPR__ROUNDS = 16, /* turns at most; more than three only if the last one helped */
    SPR__DENSE = 6    /* where more than one in so many is bad, the surface is the cause */
};

typedef struct spr__extreme {
    double          value[SPR__EXTREME]; /* ascending */
    delaunay_handle t[SPR__EXTREME];
    int             num;
} spr__extreme;

static void spr__extreme_add(spr__extreme *x, double value, delaunay_handle t)
{
    int i;
    if (x->num == SPR__EXTREME && value >= x->value[x->num - 1]) return;
    if (x->num < SPR__EXTREME) x->num++;
    for (i = x->num - 1; i > 0 && x->value[i - 1] > value; i--) {
        x->value[i] = x->value[i - 1];
        x->t[i] = x->t[i - 1];
    }
    x->value[i] = value;
    x->t[i] = t;
}

/* spr__extremes of the first n of four tetrahedra; a row for each measure. */
static void spr__four_extremes(const spr__state *s, const delaunay_handle *t, int n,
                               double (*out)[4])
{
    const double *p[4][4];
    double e[3];
    int i, k;
    for (i = 0; i < 4; i++)
        for (k = 0; k < 4; k++) p[i][k] = spr__point(s->mesh, s->mesh->tets[t[i < n ? i : 0]].v[k]);
#if defined(SPR__TARGET)
    if (s->simd) {
        spr__points4_extremes_avx2(p, out);
        return;
    }
#endif
    for (i = 0; i < n; i++) {
        spr__extremes(p[i][0], p[i][1], p[i][2], p[i][3], e);
        for (k = 0; k < 3; k++) out[k][i] = e[k];
    }
}

/* Adds those of up to four tetrahedra that have an extreme angle to s->items. Returns 0 if out of
 * memory. */
static int spr__list_extremes(spr__state *s, const delaunay_handle *t, int n)
{
    double e[3][4];
    int i, ok = 1;
    if (n == 0) return 1;
    spr__four_extremes(s, t, n, e);
    for (i = 0; i < n && ok; i++)
        if (e[0][i] < 1 || e[1][i] < 1 || e[2][i] < 1)
            ok = delaunay_list_push(&s->items, t[i]) == DELAUNAY_OK;
    return ok;
}

/* Puts all tetrahedra with an extreme angle into s->items. Returns 0 if out of memory. */
static int spr__find_extremes(spr__state *s)
{
    delaunay_handle t, four[4];
    int n = 0, ok = 1;
    for (s->items.count = 0, t = 1; t < s->mesh->num_tets && ok; t++) {
        if (!(s->value[t] < s->target + SPR__ROUND)) continue;
        four[n++] = t;
        if (n < 4) continue;
        ok = spr__list_extremes(s, four, n);
        n = 0;
    }
    return ok && spr__list_extremes(s, four, n);
}

/* Drops the tetrahedra of the current patches from s->items; after shaking, spr__list_patch adds
 * those that still, or now, have an extreme angle. */
static void spr__drop_claimed(spr__state *s)
{
    size_t i, n = 0;
    for (i = 0; i < s->items.count; i++)
        if (!(s->at[s->items.items[i]].shaken & SPR__CLAIMED))
            s->items.items[n++] = s->items.items[i];
    s->items.count = n;
}

static int spr__list_patch(spr__state *s, const spr__patch *p)
{
    size_t i;
    int ok = 1;
    for (i = 0; i < p->num_tets && ok; i++)
        if (s->value[p->t[i]] < s->target + SPR__ROUND) ok = spr__list_extremes(s, &p->t[i], 1);
    return ok;
}

/* The worst of s->items by each measure, without those whose angles were tried; and s->extreme. */
static void spr__worst_extremes(spr__state *s, spr__extreme *x)
{
    double e[3][4];
    size_t i;
    int k;
    memset(x, 0, 3 * sizeof *x);
    s->extreme[0] = s->extreme[1] = s->extreme[2] = 1;
    for (i = 0; i < s->items.count; i++) {
        delaunay_handle t = s->items.items[i];
        spr__four_extremes(s, &t, 1, e);
        for (k = 0; k < 3; k++) s->extreme[k] = spr__min(s->extreme[k], e[k][0]);
        if (s->at[t].shaken & SPR__ROUNDED) continue;
        for (k = 0; k < 3; k++)
            if (e[k][0] < 1) spr__extreme_add(&x[k], e[k][0], t);
    }
}

/* Makes a patch around each of them, measure `first` first; what overlaps waits for the next turn.
 * Only the first `dense` may be where many are bad. Returns the number of patches, or an error. */
static int spr__round_set(spr__state *s, spr__patch *patch, delaunay_list *star,
                          const spr__extreme *x, int first, int dense)
{
    uint32_t left = spr__new_left(s), new_ = SPR__PATCH_NEW;
    int num = 0, i, k, answer;
    size_t j;
    for (i = 0; i < 3 * SPR__EXTREME && num < SPR__PATCHES / 2; i++) {
        const spr__extreme *y = &x[(i + first) % 3];
        spr__patch *p = &patch[num];
        if (i / 3 >= y->num || (s->at[y->t[i / 3]].shaken & SPR__CLAIMED)) continue;
        answer = spr__patch_set(s, delaunay_engine_worker(s->engine, 0), p, y->t[i / 3],
                                i < dense ? 0 : SPR__DENSE, star);
        if (answer < 0) return answer;
        if (answer == 0) continue;
        s->at[y->t[i / 3]].shaken |= SPR__ROUNDED;
        p->max_new = left < new_ ? left : new_;
        left -= p->max_new;
        p->visit = 0;
        p->rounding = 1;
        p->kind = (i + first) % 3;
        p->few = y->value[i / 3] < SPR__RISEN * s->extreme[p->kind];
        p->lack = 0;
        for (k = 0; k < 3; k++) p->extreme[k] = 4;
        for (j = 0; j < p->num_tets; j++) {
            spr__add_extremes(s->mesh, p->t[j], p->extreme, &p->lack);
            s->at[p->t[j]].shaken |= SPR__CLAIMED;
        }
        for (k = 0; k < 3; k++)
            p->may_be[k] = spr__min(p->extreme[k], spr__max(s->extreme[k], SPR__MILD));
        num++;
    }
    return num;
}

/* Makes a few of the most extreme angles less extreme, at the price that spr__patch_is_rounder
 * allows. */
static spr_result spr__round(spr__state *s)
{
    spr__patch *patch = (spr__patch *)delaunay_alloc(s->memory, SPR__PATCHES, sizeof *patch);
    spr__extreme x[3];
    delaunay_list list;
    spr_result result = patch && spr__find_extremes(s) ? SPR_OK : SPR_ERROR_OUT_OF_MEMORY;
    int turn, turns = (int)spr__by_effort(s, SPR__ROUNDS), i, num, found = 1;
    memset(&list, 0, sizeof list);
    list.memory = s->memory;
    s->least = spr__worst_of(s, s->bad.items, s->bad.count);
    s->shake_credit = 2 * spr__most_credit(s);
    for (turn = 0; turn < turns && result == SPR_OK && s->shake_credit > 0; turn++) {
        if (turn > 2 && found == 0) break;
        spr__worst_extremes(s, x);
        found = num = spr__round_set(s, patch, &list, x, turn % 3, turn == 0 ? 6 : 3);
        if (num > 0) {
            spr__drop_claimed(s);
            found = spr__patches_shake(s, patch, num);
        }
        if (found < 0) result = (spr_result)found;
        for (i = 0; i < num && result == SPR_OK; i++)
            if (!spr__list_patch(s, &patch[i])) result = SPR_ERROR_OUT_OF_MEMORY;
        if (num <= 0) break;
        if (result == SPR_OK) result = spr__look_up(s);
    }
    delaunay_list_free(&list);
    delaunay_release(s->memory, patch);
    return result;
}

/* Begins the next stage when nothing more can be gained in this one: lifting, tidying, shaking,
 * thinning. Returns SPR_GOAL_NOT_MET after the last. */
static spr_result spr__next_stage(spr__state *s, int *shaken)
{
    spr_result result;
    if (s->is_lifting) {
        s->is_lifting = 0;
        if (s->lifts > 2) memcpy(s->allowance, s->kept_allowance, sizeof s->allowance);
    } else if (spr__may_lift(s)) {
        if (!spr__lift(s)) return SPR_ERROR_OUT_OF_MEMORY;
    } else if (!s->tidy) {
        if (s->num_bad > s->tidy_below) return SPR_GOAL_NOT_MET;
        spr__tidy(s);
    } else if (s->is_patch) {
        return SPR_GOAL_NOT_MET;
    } else if (!s->options.no_smoothing && !*shaken) {
        result = spr__shake(s);
        *shaken = result == SPR_GOAL_NOT_MET; /* now what has changed is tried */
        return *shaken ? SPR_OK : result;
    } else {
        if (s->thins || spr__is_off(s, SPR__REMOVE)) return SPR_GOAL_NOT_MET;
        spr__thin(s);
    }
    return SPR_OK;
}

/* Runs a level, and adds its time to the report. */
static spr_result spr__run_timed(spr__state *s, int level)
{
    double start = delaunay_seconds(&s->options.host), took;
    spr_result result = spr__run(s, level);
    took = delaunay_seconds(&s->options.host) - start;
    if (level == SPR__EDGES) s->report->seconds_edge_removal += took;
    else if (level == SPR__SMOOTH) s->report->seconds_smoothing += took;
    else s->report->seconds_reconnection += took;
    return result;
}

static spr_result spr__schedule(spr__state *s)
{
    spr_result result = SPR_OK;
    int sweeps, level, shaken = 0;
    spr__set_allowance(s);
    if (!s->is_patch) s->tidy_below = UINT64_MAX;
    for (sweeps = 0; result == SPR_OK; sweeps++) {
        if (s->options.max_rounds > 0 && sweeps >= s->options.max_rounds)
            return SPR_STOPPED_BY_BUDGET;
        level = spr__refresh(s);
        if (level == SPR__HOPELESS) result = spr__next_stage(s, &shaken);
        else result = s->is_patch ? spr__run(s, level) : spr__run_timed(s, level);
    }
    return result == SPR_GOAL_NOT_MET ? SPR_OK : result;
}

/* -- raising: of a mesh without bad tetrahedra the worst few are improved beyond the target */

enum {
    SPR__RAISED = 500,     /* one tetrahedron in so many is raised, */
    SPR__RAISED_MORE = 4,  /* and so many more, */
    SPR__RAISE_PLANS = 16  /* by so many plans of each level for each of them */
};

/* The quality that no more than the worst few do not reach: of two rows of bins the second divides
 * one of the first. */
static double spr__aim(const spr__state *s)
{
    enum { SPR__BINS = 128 };
    uint64_t left = s->report->before.num_tets / SPR__RAISED + SPR__RAISED_MORE;
    double aim = s->target, width = 1 - s->target;
    delaunay_handle t;
    int row, i;
    for (row = i = 0; row < 2 && i < SPR__BINS; row++) {
        uint64_t num[SPR__BINS] = {0};
        width /= (double)SPR__BINS;
        for (t = 1; t < s->mesh->num_tets; t++) {
            double bin = (s->value[t] - aim) / width;
            if (bin >= 0 && bin < (double)SPR__BINS) num[(int)bin]++;
        }
        for (i = 0; i < SPR__BINS && num[i] <= left; i++) left -= num[i];
        aim += width * i;
    }
    return aim;
}

/* Forgets what was found out about bad tetrahedra, of which there are none. */
static void spr__forget_cases(spr__state *s)
{
    delaunay_handle t;
    for (t = 1; t < s->mesh->num_tets; t++) {
        s->at[t].number = 0;
        s->at[t].listed = s->at[t].restarts = 0;
    }
    s->bad.count = s->free_cases.count = 0;
    s->num_cases = 1;
    memset(s->stays, 0, s->cap_vertices * sizeof *s->stays);
    memset(s->still, 0, s->cap_vertices * sizeof *s->still);
    memset(s->vain, 0, ((size_t)1 << s->vain_bits) * sizeof *s->vain);
}

/* Only without a target or max_rounds of the caller's, which end the improvement. */
static int spr__may_raise(const spr__state *s)
{
    return s->num_bad == 0 && !(s->options.target > 0) && s->options.max_rounds == 0;
}

/* Raises the target to what nearly all tetrahedra reach, and improves those that do not. */
static spr_result spr__raise(spr__state *s)
{
    const double aim = spr__aim(s);
    spr_result result = SPR_OK;
    int level;
    if (!(aim > s->target)) return SPR_OK;
    s->target = aim;
    s->raises = 1;
    s->tidy = s->thins = 0;
    spr__forget_cases(s);
    if (!spr__find_bad(s)) return SPR_ERROR_OUT_OF_MEMORY;
    for (level = 0; level < SPR__HOPELESS; level++)
        s->allowance[level] = spr__by_effort(s, SPR__RAISE_PLANS * (uint64_t)s->bad.count);
    while (result == SPR_OK && (level = spr__refresh(s)) != SPR__HOPELESS)
        result = spr__run_timed(s, level);
    return result;
}

/* Back to the caller's target, below which there was nothing. */
static void spr__end_raising(spr__state *s, double target)
{
    s->target = target;
    s->num_bad = 0;
    s->raises = 0;
}

/* -- flips for the mean: their passes */

/* The quality below which flips are tried: the greatest multiple of 1/20, hardly above the mean,
 * with no more tetrahedra below it than one pass may try. */
static double spr__fair(const spr__state *s)
{
    const uint64_t most = SPR__MEAN_PLANS + s->report->before.num_tets / SPR__MEAN_SHARE;
    uint64_t num = 0;
    int i;
    for (i = 0; i < 20 && i < 20 * s->mean; i++) {
        num += s->report->before.histogram[i];
        if (num > most) break;
    }
    return i / 20.0;
}

/* Flips for the mean, around tetrahedra below it: only the worst if they are too many. */
static spr_result spr__flip_for_mean(spr__state *s)
{
    delaunay_speculation job;
    delaunay_handle t;
    spr_result result = SPR_OK;
    uint32_t since = 0, round_;
    double start = delaunay_seconds(&s->options.host);
    int pass;
    s->sweep = SPR__MEAN;
    s->in_flight = SPR__MEAN_BATCH;
    s->mean = s->report->before.mean;
    s->fair = spr__fair(s);
    for (pass = 0; pass < SPR__MEAN_PASSES && result == SPR_OK && s->fair > 0; pass++) {
        round_ = delaunay_engine_round(s->engine);
        for (s->items.count = 0, t = 1; t < s->mesh->num_tets; t++) {
            if (!(s->value[t] < s->fair) || !spr__has_changed(s, s->mesh->tets[t].v, since))
                continue;
            if (delaunay_list_push(&s->items, t) != DELAUNAY_OK) return SPR_ERROR_OUT_OF_MEMORY;
        }
        since = round_ + 1;
        memset(&job, 0, sizeof job);
        job.plan = spr__plan_mean;
        job.done = spr__done;
        job.batch = SPR__MEAN_BATCH;
        result = spr__speculate(s, &job);
    }
    s->report->seconds_edge_removal += delaunay_seconds(&s->options.host) - start;
    return result;
}

/* Why t, which is in the list, is left; any reason if it is not. stopped: the call was, perhaps
 * before most were tried, and it would take too long to find out now what the surface allows. */
static spr_reason spr__reason(const spr__state *s, delaunay_handle t, int stopped)
{
    int held;
    if (delaunay_is_deleted(s->mesh, t) || s->value[t] >= s->target) return SPR_STUCK;
    held = stopped ? spr__is_held(s, t) : (float)spr__goal(s, t) < (float)s->target;
    if (held && (float)spr__bound(s, t, s->target, 0) < (float)s->target) return SPR_BOUNDED;
    if (spr__is_fixed(s, t)) return SPR_FIXED;
    if (held && s->value[t] >= (double)spr__case_of(s, t)->goal) return SPR_BUDGET; /* not tried */
    if (s->gone >= s->max_gone || s->credit_ended) return SPR_BUDGET;
    return s->at[t].level != SPR__HOPELESS ||
                   spr__has_changed(s, s->mesh->tets[t].v, spr__case_of(s, t)->tried + 1)
               ? SPR_BUDGET
               : SPR_STUCK;
}

/* Records why the bad ones in the list are left, and frees what only the schedule needs. stopped:
 * as in spr__reason. Returns 0 if out of memory. */
static int spr__end_schedule(spr__state *s, int stopped)
{
    size_t i;
    delaunay_engine_free(s->engine);
    delaunay_release(s->memory, s->still);
    delaunay_release(s->memory, s->stays);
    delaunay_release(s->memory, s->vain);
    s->engine = NULL;
    s->still = s->stays = s->vain = NULL;
    s->left = (uint8_t *)delaunay_alloc(s->memory, s->bad.count + 1, sizeof *s->left);
    for (i = 0; s->left && i < s->bad.count; i++)
        s->left[i] = (uint8_t)spr__reason(s, s->bad.items[i], stopped);
    delaunay_release(s->memory, s->at);
    delaunay_release(s->memory, s->cases);
    delaunay_list_free(&s->free_cases);
    s->at = NULL;
    s->cases = NULL;
    return s->left != NULL;
}

/* -- one sweep of relaxation over all vertices that may move */

/* Puts the vertices that may move in the order of the curve. */
static spr_result spr__sweep_order(const spr__state *s, spr__sweep *w, int threads)
{
    const delaunay_mesh *m = s->mesh;
    uint64_t *keys = (uint64_t *)delaunay_alloc(s->memory, m->num_vertices, sizeof *keys);
    hxtsort_options sort;
    hilbert_box box;
    spr_result result = SPR_ERROR_OUT_OF_MEMORY;
    size_t i;
    uint32_t v;
    memset(&box, 0, sizeof box);
    memset(&sort, 0, sizeof sort);
    w->vertex = (uint32_t *)delaunay_alloc(s->memory, m->num_vertices, sizeof *w->vertex);
    w->place = (uint32_t *)delaunay_alloc(s->memory, m->num_vertices, sizeof *w->place);
    if (!keys || !w->vertex || !w->place) goto done;
    (void)hilbert_box_fit3(&box, m->vertices[1].x, sizeof *m->vertices, m->num_vertices - 1,
                           threads);
    hilbert_box_cube(&box);
    box.depth = SPR__CURVE_DEPTH;
    if (hilbert_keys3(keys, m->vertices[0].x, sizeof *m->vertices, m->num_vertices, &box,
                      threads) != HILBERT_OK)
        memset(keys, 0, m->num_vertices * sizeof *keys);
    for (v = 1; v < m->num_vertices; v++)
        if (s->movable[v] && m->vertex_tet[v]) {
            keys[w->num] = keys[v];
            w->vertex[w->num++] = v;
        }
    sort.num_threads = threads;
    sort.scratch_bytes = hxtsort_scratch_bytes(sizeof *keys + sizeof *w->vertex, w->num, threads);
    sort.scratch = delaunay_alloc(s->memory, sort.scratch_bytes, 1);
    if (!sort.scratch) goto done;
    result = (spr_result)hxtsort_u64_u32(keys, w->vertex, w->num, &sort);
    for (v = 0; v < m->num_vertices; v++) w->place[v] = SPR__AT_REST;
    for (i = 0; i < w->num; i++) w->place[w->vertex[i]] = (uint32_t)i;
done:
    delaunay_release(s->memory, sort.scratch);
    delaunay_release(s->memory, keys);
    return result;
}

/* The stars of the vertices at places first .. last-1: counts their sizes or, with fill, writes
 * them. */
static void spr__sweep_count(const spr__state *s, const spr__sweep *w, size_t first, size_t last,
                             int fill)
{
    const delaunay_mesh *m = s->mesh;
    delaunay_handle t;
    int i;
    for (t = 1; t < m->num_tets; t++) {
        if (delaunay_is_deleted(m, t)) continue;
        for (i = 0; i < 4; i++) {
            size_t k = w->place[m->tets[t].v[i]];
            if (k < first || k >= last) continue;
            if (fill) w->star[w->row[k]] = t;
            w->row[k]++;
        }
    }
}

/* Makes the rows of stars. Each thread has a range of places and scans all tetrahedra. */
static spr_result spr__sweep_stars(const spr__state *s, spr__sweep *w, int threads)
{
    size_t k, sum = 0, count, share = w->num / (size_t)threads + 1;
    int i;
    w->row = (size_t *)delaunay_alloc(s->memory, w->num + 2, sizeof *w->row);
    w->list = (uint32_t *)delaunay_alloc(s->memory, w->num, sizeof *w->list);
    w->rests = (uint8_t *)delaunay_alloc(s->memory, w->num, 1);
    if (!w->row || !w->list || !w->rests) return SPR_ERROR_OUT_OF_MEMORY;
    memset(w->row, 0, (w->num + 2) * sizeof *w->row);
    /* each thread writes the rows of its places; the mesh is read */
    SPR__OMP(omp parallel for schedule(static) num_threads(threads))
    for (i = 0; i < threads; i++)
        spr__sweep_count(s, w, (size_t)i * share, (size_t)(i + 1) * share, 0);
    for (k = 0; k <= w->num; k++) {
        count = w->row[k];
        w->row[k] = sum;
        sum += count;
    }
    w->star = (delaunay_handle *)delaunay_alloc(s->memory, sum, sizeof *w->star);
    if (!w->star) return SPR_ERROR_OUT_OF_MEMORY;
    /* each thread writes the rows and stars of its places */
    SPR__OMP(omp parallel for schedule(static) num_threads(threads))
    for (i = 0; i < threads; i++)
        spr__sweep_count(s, w, (size_t)i * share, (size_t)(i + 1) * share, 1);
    for (k = w->num; k > 0; k--) w->row[k] = w->row[k - 1]; /* each is where the next one begins */
    w->row[0] = 0;
    for (k = 0; k < w->num; k++) w->list[k] = (uint32_t)k;
    w->left = w->num;
    return SPR_OK;
}

/* Drops from the list the vertices that have had their turn. */
static void spr__sweep_next(spr__sweep *w)
{
    size_t i, n = 0;
    for (i = 0; i < w->left; i++) {
        uint32_t v = w->vertex[w->list[i]];
        w->place[v] = w->rests[i] ? SPR__AT_REST : (uint32_t)n;
        if (!w->rests[i]) w->list[n++] = w->list[i];
    }
    w->left = n;
}

/* One pass over what is left, in blocks. A vertex has its turn if all its neighbours are at rest,
 * in its own block or in later ones. Its neighbours in later blocks then wait, as they have a
 * neighbour in an earlier one. So no thread moves or reads what another one moves, and the result
 * depends on the blocks alone. The first block never waits, so that each pass leaves fewer. */
static spr_result spr__relax_pass(spr__state *s, const spr__sweep *w, int threads)
{
    int64_t blocks = (int64_t)((w->left + SPR__RELAX_BLOCK - 1) / SPR__RELAX_BLOCK), first, i;
    spr_result result = SPR_OK;
    (void)threads;
    memset(w->rests, 0, w->left);
    for (first = 0; first < blocks && result == SPR_OK; first += SPR__RELAX_BLOCKS) {
        int64_t last = first + SPR__RELAX_BLOCKS < blocks ? first + SPR__RELAX_BLOCKS : blocks;
        uint64_t moved = 0;
        /* a thread moves vertices of its block, whose neighbours nobody else moves or reads now */
        SPR__OMP(omp parallel for schedule(dynamic, 1) num_threads(threads) reduction(+ : moved))
        for (i = first; i < last; i++)
            moved += spr__relax_block(s, w, (size_t)i * SPR__RELAX_BLOCK);
        s->report->relaxed += moved;
        result = spr__look_up(s);
    }
    s->shown = spr__next_shown(s);
    return result;
}

/* relax_floor: half way from the target to 1, or the worst of the mesh if that is better. The worst
 * of a star that is above this may fall to it. */
static double spr__relax_floor(const spr__state *s, int threads)
{
    const int64_t num = (int64_t)s->mesh->num_tets;
    double worst = HUGE_VAL;
    int64_t t;
    (void)threads;
    SPR__OMP(omp parallel for schedule(static) num_threads(threads) reduction(min : worst))
    for (t = 1; t < num; t++)
        if (s->value[t] < worst) worst = s->value[t];
    return spr__max(0.5 * (1 + s->target), worst < HUGE_VAL ? worst : 0);
}

/* One sweep over all vertices that may move. */
static spr_result spr__relax(spr__state *s)
{
    int threads = delaunay_threads_for(&s->options.host, s->mesh->num_tets);
    double start = delaunay_seconds(&s->options.host);
    spr__sweep w;
    spr_result result;
    memset(&w, 0, sizeof w);
    s->relax_floor = spr__relax_floor(s, threads);
    result = spr__sweep_order(s, &w, threads);
    if (result == SPR_OK) result = spr__sweep_stars(s, &w, threads);
    while (result == SPR_OK && w.left > 0) {
        result = spr__relax_pass(s, &w, threads);
        spr__sweep_next(&w);
    }
    delaunay_release(s->memory, w.vertex);
    delaunay_release(s->memory, w.place);
    delaunay_release(s->memory, w.row);
    delaunay_release(s->memory, w.star);
    delaunay_release(s->memory, w.list);
    delaunay_release(s->memory, w.rests);
    s->report->seconds_smoothing += delaunay_seconds(&s->options.host) - start;
    return result;
}

/* ---- >>public ----------------------------------------------------------------------------- */

SPR_API const char *spr_result_string(spr_result result)
{
    switch (result) {
    case SPR_OK: return "success";
    case SPR_STOPPED_BY_BUDGET: return "stopped by a budget; the mesh is valid";
    case SPR_GOAL_NOT_MET: return "some tetrahedra are below the target; the mesh is valid";
    case SPR_ERROR_INVALID_ARGUMENT: return "invalid argument";
    case SPR_ERROR_OUT_OF_MEMORY: return "out of memory";
    case SPR_CANCELLED: return "cancelled by the caller; the mesh is valid";
    case SPR_ERROR_TOO_LARGE: return "the result does not fit";
    case SPR_ERROR_INTERNAL: return "internal error";
    case SPR_ERROR_INVALID_MESH: return "the mesh is not valid";
    }
    return "unknown spr_result";
}

/* Says in the report which option is wrong, by its name and value. */
static spr_result spr__bad_option(spr_report *report, const char *what, double value)
{
    snprintf(report->message, sizeof report->message, "invalid argument: options.%s is %.9g", what,
             value);
    return SPR_ERROR_INVALID_ARGUMENT;
}

/* Whether all options are in range; if not, the report says which one is not. */
static spr_result spr__check_options(const spr_options *o, spr_report *report)
{
    const double effort = o->effort;
    if (o->measure < SPR_GAMMA || o->measure > SPR_USER)
        return spr__bad_option(report, "measure", (double)o->measure);
    if (!(o->target >= 0 && o->target <= 1))
        return spr__bad_option(report, "target, which should be 0 to 1,", o->target);
    if (!(o->max_seconds >= 0)) return spr__bad_option(report, "max_seconds", o->max_seconds);
    if (o->max_rounds < 0) return spr__bad_option(report, "max_rounds", o->max_rounds);
    if (effort != 0 && !(effort >= 0.01 && effort <= 100))
        return spr__bad_option(report, "effort, which should be 0 or 0.01 to 100,", effort);
    if (o->host.num_threads < 0)
        return spr__bad_option(report, "host.num_threads", o->host.num_threads);
    if (o->measure != SPR_USER || o->quality) return SPR_OK;
    snprintf(report->message, sizeof report->message,
             "invalid argument: options.quality is NULL, the measure SPR_USER");
    return SPR_ERROR_INVALID_ARGUMENT;
}

/* Checks the options, and sets the target, the measure and the memory account. */
static spr_result spr__open(spr__state *s, const delaunay_mesh *mesh, const spr_options *options,
                            spr_report *report, delaunay_memory *memory)
{
    memset(s, 0, sizeof *s);
    if (options) s->options = *options;
    s->report = report;
    s->memory = memory;
    s->mesh = (delaunay_mesh *)(uintptr_t)mesh;
    if (!mesh || spr__check_options(&s->options, report) != SPR_OK)
        return SPR_ERROR_INVALID_ARGUMENT;
    s->target = s->options.target > 0 ? s->options.target : 0.35;
    s->effort = s->options.effort > 0 ? s->options.effort : 1;
    s->gamma = s->options.measure == SPR_GAMMA;
    s->simd = SPR__AVX2 != 0;
    s->quality = s->options.measure == SPR_GAMMA  ? NULL /* spr_gamma is called directly */
                 : s->options.measure == SPR_SICN ? spr__measure_sicn
                 : s->options.measure == SPR_USER ? s->options.quality
                                                  : spr__measure_sine;
    s->quality_user = s->options.quality_user;
    return (spr_result)delaunay_memory_init(memory, &s->options.host);
}

SPR_API spr_result spr_measure_mesh(const delaunay_mesh *mesh, const spr_options *options,
                                    spr_statistics *out)
{
    spr__state s;
    spr_report report;
    delaunay_memory memory;
    spr_result result = spr__open(&s, mesh, options, &report, &memory);
    if (result != SPR_OK || !out) return result != SPR_OK ? result : SPR_ERROR_INVALID_ARGUMENT;
    s.value = (double *)delaunay_alloc(&memory, mesh->num_tets, sizeof *s.value);
    if (!s.value) return SPR_ERROR_OUT_OF_MEMORY;
    result = spr__statistics(&s, out);
    delaunay_release(&memory, s.value);
    return result;
}

/* The region of t, 0 outside. */
static uint32_t spr__region(const delaunay_mesh *m, delaunay_handle t)
{
    if (!spr__is_inside(m, t)) return 0;
    return m->color ? m->color[t] : 1;
}

/* Fixes v. Several threads may do so at once. */
static void spr__pin(const spr__state *s, uint32_t v)
{
    SPR__OMP(omp atomic write)
    s->movable[v] = 0;
}

/* Fixes the vertices of t if it is outside, and those on a constrained facet, on a facet without a
 * neighbour, or on a constrained edge. */
static void spr__pin_of(const spr__state *s, delaunay_handle t, uint32_t region)
{
    const delaunay_mesh *m = s->mesh;
    const delaunay_tet *x = &m->tets[t];
    const unsigned flags = m->flags ? m->flags[t] : 0;
    int i, k;
    for (i = 0; i < 4; i++) {
        if (region == 0) spr__pin(s, x->v[i]);
        if (x->n[i] != 0 && !(flags & DELAUNAY_FACET_BIT(i))) continue;
        for (k = 0; k < 3; k++) spr__pin(s, x->v[delaunay_facet_order(i)[k]]);
    }
    for (i = 0; i < 6 && (flags & DELAUNAY_EDGE_BITS); i++)
        for (k = 0; k < 2 && (flags & DELAUNAY_EDGE_BIT(i)); k++)
            spr__pin(s, x->v[delaunay_edge_order(i)[k]]);
}

/* Fixes vertices with tetrahedra of several regions. stamp, which is scratch here, gets one region
 * of each vertex. */
static void spr__pin_borders(spr__state *s, int threads)
{
    const delaunay_mesh *m = s->mesh;
    const int64_t num = (int64_t)m->num_tets;
    int64_t t;
    int pass, i;
    (void)threads;
    for (pass = 0; pass < 2; pass++) {
        SPR__OMP(omp parallel for schedule(static) num_threads(threads) private(i))
        for (t = 1; t < num; t++) {
            const uint32_t *v = m->tets[t].v, region = spr__region(m, (delaunay_handle)t);
            for (i = 0; i < 4 && region; i++) {
                if (pass) {
                    if (s->stamp[v[i]] != region) spr__pin(s, v[i]);
                } else {
                    SPR__OMP(omp atomic write)
                    s->stamp[v[i]] = region;
                }
            }
        }
    }
    memset(s->stamp, 0, m->num_vertices * sizeof *s->stamp);
}

/* Finds which vertices may move and be removed: those with tetrahedra of one region, on no wall and
 * no constrained edge. */
static void spr__find_movable(spr__state *s)
{
    const delaunay_mesh *m = s->mesh;
    const int64_t num = (int64_t)m->num_tets;
    const int threads = delaunay_threads_for(&s->options.host, m->num_tets);
    uint32_t v, least = UINT32_MAX, most = 0;
    int64_t t;
    (void)threads;
    for (v = 1; v < m->num_vertices; v++)
        s->movable[v] = m->vertex_id[v] == DELAUNAY_NO_ID || s->options.free_vertices;
    for (v = 1; v < m->num_vertices && s->options.fixed_vertices; v++)
        if (s->options.fixed_vertices[v]) s->movable[v] = 0;
    s->movable[0] = 0;
    /* several threads may clear the same movable[v]: by atomic writes */
    SPR__OMP(omp parallel for schedule(static) num_threads(threads) reduction(min : least) \
             reduction(max : most))
    for (t = 1; t < num; t++) {
        const uint32_t region = spr__region(m, (delaunay_handle)t);
        if (delaunay_is_deleted(m, (delaunay_handle)t)) continue;
        spr__pin_of(s, (delaunay_handle)t, region);
        if (region && region < least) least = region;
        if (region > most) most = region;
    }
    if (least < most) spr__pin_borders(s, threads);
}

static void spr__describe(const spr__state *s, spr_worst *w, delaunay_handle t, spr_reason reason)
{
    w->tet = t;
    w->reason = reason;
    w->quality = s->value[t];
    w->bound = spr__bound(s, t, HUGE_VAL, 0);
    spr__middle(s->mesh, t, w->xyz);
}

/* Reports the worst that are left, and why; calls options.left for each that is left. */
static void spr__explain(spr__state *s)
{
    spr_report *r = s->report;
    uint64_t *count[4];
    spr_worst w;
    size_t i;
    int j;
    count[SPR_BOUNDED] = &r->bounded;
    count[SPR_FIXED] = &r->fixed;
    count[SPR_STUCK] = &r->stuck;
    count[SPR_BUDGET] = &r->unfinished;
    for (i = 0; i < s->bad.count; i++) {
        delaunay_handle t = s->bad.items[i];
        spr_reason reason;
        if (delaunay_is_deleted(s->mesh, t) || s->value[t] >= s->target) continue;
        reason = (spr_reason)s->left[i];
        if (s->options.left) {
            spr__describe(s, &w, t, reason);
            s->options.left(s->options.left_user, &w);
        }
        ++*count[reason];
        for (j = r->num_worst; j > 0 && r->worst[j - 1].quality > s->value[t]; j--)
            if (j < 5) r->worst[j] = r->worst[j - 1];
        if (j == 5) continue;
        r->worst[j].quality = s->value[t];
        r->worst[j].tet = t;
        r->worst[j].reason = reason;
        if (r->num_worst < 5) r->num_worst++;
    }
    for (j = 0; j < r->num_worst; j++)
        spr__describe(s, &r->worst[j], r->worst[j].tet, r->worst[j].reason);
}

/* Deletes vertices without an id that are in no tetrahedron; the others keep their order. */
static void spr__compact(spr__state *s)
{
    delaunay_mesh *m = s->mesh;
    const int64_t num = (int64_t)m->num_tets;
    const int threads = delaunay_threads_for(&s->options.host, m->num_tets);
    uint32_t v, n = 1, *number = s->stamp;
    int64_t t;
    int i;
    (void)threads;
    number[0] = 0;
    for (v = 1; v < m->num_vertices; v++) {
        number[v] = n;
        if (m->vertex_id[v] == DELAUNAY_NO_ID && m->vertex_tet[v] == 0) continue;
        m->vertices[n] = m->vertices[v];
        m->vertex_id[n] = m->vertex_id[v];
        if (m->weight) m->weight[n] = m->weight[v];
        m->vertex_tet[n++] = m->vertex_tet[v];
    }
    if (n == m->num_vertices) return;
    m->num_vertices = n;
    SPR__OMP(omp parallel for schedule(static) num_threads(threads) private(i))
    for (t = 1; t < num; t++)
        for (i = 0; i < 4; i++) m->tets[t].v[i] = number[m->tets[t].v[i]];
    for (v = 0; v < m->num_points && m->vertex_of; v++) m->vertex_of[v] = number[m->vertex_of[v]];
}

static void spr__close(spr__state *s)
{
    spr__pools_free(s);
    delaunay_engine_free(s->engine);
    delaunay_list_free(&s->bad);
    delaunay_list_free(&s->items);
    delaunay_release(s->memory, s->value);
    delaunay_release(s->memory, s->at);
    delaunay_release(s->memory, s->cases);
    delaunay_list_free(&s->free_cases);
    delaunay_release(s->memory, s->left);
    delaunay_release(s->memory, s->still);
    delaunay_release(s->memory, s->stays);
    if (!s->is_patch) delaunay_release(s->memory, s->vain); /* that of a patch is lent */
    delaunay_release(s->memory, s->stamp);
    delaunay_release(s->memory, s->movable);
}

/* A new vertex brings about six tetrahedra, so the mesh grows by a third at most. Few meshes need
 * that: thin tubes without a vertex inside, where all else would be tried in vain. More may be
 * removed: between walls that are close to each other every vertex makes more tetrahedra bad, and
 * those that refinement put there are best removed. */
enum { SPR__TETS_A_VERTEX = 20, SPR__TETS_A_GONE = 12 };

/* Everything between spr__open and spr__close. */
static spr_result spr__improve(spr__state *s, uint32_t max_new)
{
    spr_result result = SPR_ERROR_OUT_OF_MEMORY, after;
    const double target = s->target;
    uint64_t most;
    s->bad.memory = s->items.memory = s->free_cases.memory = s->memory;
    if (s->mesh->num_tets < 2) return SPR_OK;
    if (!s->mesh->vertex_tet && delaunay_link_vertices(s->mesh) != DELAUNAY_OK) return result;
    /* one number for all steps: OpenMP's maximum may change, and the engine keeps its workers */
    s->options.host.num_threads = delaunay_threads(&s->options.host);
    s->engine = delaunay_engine_new(s->mesh, &s->options.host);
    if (!s->engine || !spr__fit(s)) return result;
    result = spr__statistics(s, &s->report->before);
    if (result != SPR_OK) return result;
    s->first_new = s->mesh->num_vertices;
    most = s->report->before.num_tets / SPR__TETS_A_VERTEX + 6;
    s->max_gone = s->report->before.num_tets / SPR__TETS_A_GONE + 6;
    s->room_new = s->options.keep_vertices ? 0 : max_new;
    s->max_new = most < s->room_new ? (uint32_t)most : s->room_new;
    spr__find_movable(s);
    if (!spr__find_bad(s) || !spr__set_vain(s)) return SPR_ERROR_OUT_OF_MEMORY;
    result = spr__look_up(s);
    if (result == SPR_OK) result = spr__schedule(s);
    if (result == SPR_OK && s->gamma && !s->options.no_smoothing) result = spr__round(s);
    if (result == SPR_OK && spr__may_raise(s)) result = spr__raise(s);
    if (result == SPR_OK && !s->options.no_edge_removal) result = spr__flip_for_mean(s);
    if (s->raises) spr__end_raising(s, target);
    if (result < 0 && result != SPR_CANCELLED) {
        /* the arrays may be smaller than the mesh, and the values in them out of date */
        if (!s->options.keep_vertices && spr__fit(s)) spr__compact(s);
        return result;
    }
    if (!spr__end_schedule(s, result != SPR_OK)) return SPR_ERROR_OUT_OF_MEMORY;
    if (result == SPR_OK && !s->options.no_smoothing) result = spr__relax(s);
    spr__explain(s);
    if (!s->options.keep_vertices) spr__compact(s);
    after = spr__statistics(s, &s->report->after);
    if (after != SPR_OK && result >= 0) return after;
    if (result == SPR_OK && s->options.require_target && s->report->after.num_below > 0)
        result = SPR_GOAL_NOT_MET;
    return result;
}

/* Improves the mesh of a patch: the schedule alone, with the preparation that this needs. */
static spr_result spr__improve_patch(spr__state *s, uint32_t max_new)
{
    const delaunay_mesh *m = s->mesh;
    delaunay_handle t;
    s->bad.memory = s->items.memory = s->free_cases.memory = s->memory;
    if (delaunay_link_vertices(s->mesh) != DELAUNAY_OK) return SPR_ERROR_OUT_OF_MEMORY;
    s->engine = delaunay_engine_new_lent(s->mesh, &s->options.host, s->lent);
    if (!s->engine || !spr__fit(s)) return SPR_ERROR_OUT_OF_MEMORY;
    for (t = 1, s->value[0] = HUGE_VAL; t < m->num_tets; t++)
        s->value[t] = spr__quality_of(s, m->tets[t].v);
    s->report->before.num_tets = m->num_tets - 1;
    s->first_new = m->num_vertices;
    s->max_gone = SPR__PATCH_NEW;
    s->max_new = s->room_new = s->options.keep_vertices ? 0 : max_new;
    spr__find_movable(s);
    return spr__find_bad(s) ? spr__schedule(s) : SPR_ERROR_OUT_OF_MEMORY;
}

/* -- a polyhedron in arrays */

static spr_result spr__refuse(spr_reconnection *out, const char *what, size_t which)
{
    snprintf(out->message, sizeof out->message, "%.80s (number %lu)", what, (unsigned long)which);
    return SPR_ERROR_INVALID_ARGUMENT;
}

/* Whether the n points of a facet or constraint are below num_points and all different. */
static int spr__has_points(const spr_polyhedron *p, const uint32_t *v, int n)
{
    int i;
    for (i = 0; i < n; i++)
        if (v[i] >= p->num_points || v[i] == v[(i + 1) % n]) return 0;
    return 1;
}

static spr_result spr__check_polyhedron(const spr_polyhedron *p, spr_reconnection *out)
{
    size_t i;
    if (!p->xyz || p->num_points < 4 || p->num_points > SPR_MAX_POINTS)
        return spr__refuse(out, "not 4 to 32 points", p->num_points);
    if (!p->facets || p->num_facets < 4 || p->num_facets > SPR_MAX_FACETS)
        return spr__refuse(out, "not 4 to 512 facets", p->num_facets);
    if (p->num_edges > SPR_MAX_CONSTRAINTS || (p->num_edges && !p->edges))
        return spr__refuse(out, "too many edges, or none given", p->num_edges);
    if (p->num_walls > SPR_MAX_CONSTRAINTS || (p->num_walls && !p->walls))
        return spr__refuse(out, "too many walls, or none given", p->num_walls);
    for (i = 0; i < 3 * p->num_points; i++)
        if (!(fabs(p->xyz[i]) <= 1e300))
            return spr__refuse(out, "a point that is not finite", i / 3);
    for (i = 0; i < p->num_facets; i++)
        if (!spr__has_points(p, p->facets + 3 * i, 3))
            return spr__refuse(out, "a facet without three points", i);
    for (i = 0; i < p->num_edges; i++)
        if (!spr__has_points(p, p->edges + 2 * i, 2))
            return spr__refuse(out, "an edge without two points", i);
    for (i = 0; i < p->num_walls; i++)
        if (!spr__has_points(p, p->walls + 3 * i, 3))
            return spr__refuse(out, "a wall without three points", i);
    return SPR_OK;
}

/* Whether two triangles have the same three points. */
static int spr__is_triangle(const uint32_t *f, const uint32_t *g)
{
    int i, k, n = 0;
    for (i = 0; i < 3; i++)
        for (k = 0; k < 3; k++) n += f[i] == g[k];
    return n == 3;
}

/* Checks that the boundary has each triangle once, is closed, and is turned outwards. on: in row a,
 * bit b is set if edge ab is on the boundary. */
static spr_result spr__check_boundary(const spr_polyhedron *p, spr_reconnection *out, uint32_t *on)
{
    signed char turn[SPR_MAX_POINTS][SPR_MAX_POINTS];
    double volume = 0, u[3][3], n[3];
    size_t i, j;
    int k;
    memset(turn, 0, sizeof turn);
    memset(on, 0, SPR_MAX_POINTS * sizeof *on);
    for (i = 0; i < p->num_facets; i++) {
        const uint32_t *f = p->facets + 3 * i;
        for (j = 0; j < i; j++)
            if (spr__is_triangle(f, p->facets + 3 * j))
                return spr__refuse(out, "a facet that is there twice", i);
        for (k = 0; k < 3; k++) {
            uint32_t a = f[k], b = f[(k + 1) % 3];
            turn[a][b]++;
            turn[b][a]--;
            on[a] |= 1u << b;
            on[b] |= 1u << a;
            spr__sub(p->xyz + 3 * a, p->xyz + 3 * p->facets[0], u[k]);
        }
        spr__cross(u[0], u[1], n);
        volume += spr__dot(n, u[2]);
    }
    for (i = 0; i < p->num_facets; i++)
        for (k = 0; k < 3; k++)
            if (turn[p->facets[3 * i + (size_t)k]][p->facets[3 * i + (size_t)(k + 1) % 3]])
                return spr__refuse(out, "the boundary is open at a facet", i);
    if (!(volume > 0)) return spr__refuse(out, "the facets turn inwards", 0);
    return SPR_OK;
}

static void spr__window_of(delaunay_window *w, const spr_polyhedron *p, const uint32_t *on)
{
    size_t i;
    int k;
    memset(w, 0, sizeof *w);
    w->num_vertices = (uint32_t)p->num_points;
    w->interior = p->num_points < 32 ? (1u << p->num_points) - 1 : ~0u;
    for (i = 0; i < p->num_points; i++) {
        w->vertices[i] = (uint32_t)i + 1;
        if (on[i]) w->interior &= ~(1u << i);
    }
    w->num_facets = (uint32_t)p->num_facets;
    for (i = 0; i < p->num_facets; i++)
        for (k = 0; k < 3; k++) w->facets[i][k] = (uint8_t)p->facets[3 * i + (size_t)k];
    for (i = 0; i < p->num_edges; i++) {
        const uint32_t *e = p->edges + 2 * i;
        if (on[e[0]] >> e[1] & 1) continue; /* it is part of any result */
        w->kept_edges[w->num_kept_edges][0] = (uint8_t)e[0];
        w->kept_edges[w->num_kept_edges++][1] = (uint8_t)e[1];
    }
    w->num_kept_facets = (uint32_t)p->num_walls;
    for (i = 0; i < p->num_walls; i++)
        for (k = 0; k < 3; k++) w->kept_facets[i][k] = (uint8_t)p->walls[3 * i + (size_t)k];
}

SPR_API spr_result spr_reconnect(const spr_polyhedron *polyhedron, double bound, uint32_t max_nodes,
                                 const spr_options *options, spr_reconnection *out)
{
    spr__state s;
    spr_report unused;
    delaunay_memory memory;
    delaunay_mesh mesh;
    delaunay_vertex vertices[SPR_MAX_POINTS + 1];
    delaunay_window window;
    delaunay_search search;
    delaunay_worker *worker;
    uint32_t on[SPR_MAX_POINTS];
    spr_result result;
    size_t i;
    if (!polyhedron || !out) return SPR_ERROR_INVALID_ARGUMENT;
    memset(out, 0, sizeof *out);
    if (!(bound >= 0)) {
        snprintf(out->message, sizeof out->message, "the bound is negative, or no number");
        return SPR_ERROR_INVALID_ARGUMENT;
    }
    memset(&mesh, 0, sizeof mesh);
    memset(vertices, 0, sizeof vertices);
    result = spr__check_polyhedron(polyhedron, out);
    if (result == SPR_OK) result = spr__check_boundary(polyhedron, out, on);
    if (result == SPR_OK) {
        result = spr__open(&s, &mesh, options, &unused, &memory);
        if (result != SPR_OK)
            snprintf(out->message, sizeof out->message, "%s", spr_result_string(result));
    }
    if (result != SPR_OK) return result;
    for (i = 0; i < polyhedron->num_points; i++)
        memcpy(vertices[i + 1].x, polyhedron->xyz + 3 * i, sizeof vertices->x);
    mesh.vertices = vertices;
    mesh.num_vertices = (uint32_t)polyhedron->num_points + 1;
    spr__window_of(&window, polyhedron, on);
    worker = delaunay_worker_new(&memory);
    if (!worker) {
        snprintf(out->message, sizeof out->message, "%s",
                 spr_result_string(SPR_ERROR_OUT_OF_MEMORY));
        return SPR_ERROR_OUT_OF_MEMORY;
    }
    memset(&search, 0, sizeof search);
    search.objective = DELAUNAY_BEST_QUALITY;
    search.quality = spr__search_quality; /* no .qualities: these differ by rounding */
    search.user = &s;
    search.bound = bound;
    search.max_nodes = max_nodes;
    out->found = delaunay_reconnect(&mesh, worker, &window, &search) > 0;
    delaunay_worker_free(worker);
    out->proven = search.proven;
    out->nodes = search.nodes;
    out->value = search.value;
    out->num_tets = search.num_tets;
    for (i = 0; i < 4 * out->num_tets; i++) out->tets[i / 4][i % 4] = search.tets[i / 4][i % 4];
    return out->found ? SPR_OK : SPR_GOAL_NOT_MET;
}

static spr_result spr__improve_mesh(delaunay_mesh *mesh, const spr_options *options,
                                    spr_report *report, uint32_t max_new)
{
    spr__state s;
    spr_report unused;
    delaunay_memory memory;
    spr_result result;
    if (!report) report = &unused;
    memset(report, 0, sizeof *report);
    result = spr__open(&s, mesh, options, report, &memory);
    if (result != SPR_OK) {
        if (!report->message[0])
            snprintf(report->message, sizeof report->message, "%s", spr_result_string(result));
        return result;
    }
    mesh->memory.limit_bytes = s.options.host.memory_limit_bytes;
    report->seconds = -delaunay_seconds(&s.options.host);
    if (s.options.max_seconds > 0) s.deadline = s.options.max_seconds - report->seconds;
    result = spr__improve(&s, max_new);
    report->seconds += delaunay_seconds(&s.options.host);
    spr__close(&s);
    report->peak_bytes = memory.peak_bytes + mesh->memory.peak_bytes;
    if (result != SPR_OK)
        snprintf(report->message, sizeof report->message, "%s", spr_result_string(result));
    return result;
}

SPR_API spr_result spr_improve(delaunay_mesh *mesh, const spr_options *options, spr_report *report)
{
    return spr__improve_mesh(mesh, options, report, UINT32_MAX);
}

/* The caller's triangles or edges, in a hash table by their vertices in any order. */
typedef struct spr__kept {
    const uint32_t *items;
    size_t num_items, mask; /* slots less one */
    uint32_t size;          /* vertices of each */
    uint32_t *slots;        /* item + 1; 0: free */
    uint8_t *met;           /* of each slot: the mesh has it */
} spr__kept;

/* The slot of an item with these vertices, all different, or where it would be. */
static size_t spr__kept_slot(const spr__kept *k, const uint32_t *v)
{
    uint64_t sum = 0;
    size_t slot;
    uint32_t i, j;
    for (i = 0; i < k->size; i++) {
        uint64_t mixed = (v[i] + UINT64_C(1)) * UINT64_C(0x9e3779b97f4a7c15);
        sum += mixed ^ mixed >> 29;
    }
    for (slot = (size_t)(sum * UINT64_C(0xbf58476d1ce4e5b9) >> 20) & k->mask; k->slots[slot];
         slot = (slot + 1) & k->mask) {
        const uint32_t *own = k->items + k->size * (size_t)(k->slots[slot] - 1);
        for (i = 0; i < k->size; i++) {
            for (j = 0; j < k->size && own[i] != v[j]; j++) {}
            if (j == k->size) break;
        }
        if (i == k->size) break;
    }
    return slot;
}

/* Fills the table. Items with a vertex twice are left out and count as absent. */
static spr_result spr__kept_init(spr__kept *k, delaunay_memory *memory, size_t num_vertices,
                                 spr_report *report)
{
    size_t cap = 16, i;
    uint32_t j;
    const char *name = k->size == 3 ? "triangles" : "edges";
    if (k->num_items >= UINT32_MAX / 2) {
        snprintf(report->message, sizeof report->message, "options.num_kept_%s is 2^31 - 1 or more",
                 name);
        return SPR_ERROR_TOO_LARGE;
    }
    if (k->num_items && !k->items) {
        snprintf(report->message, sizeof report->message,
                 "invalid argument: options.kept_%s is NULL, their number not 0", name);
        return SPR_ERROR_INVALID_ARGUMENT;
    }
    while (cap < 2 * k->num_items) cap *= 2;
    k->mask = cap - 1;
    k->slots = (uint32_t *)delaunay_alloc_zeroed(memory, cap, sizeof *k->slots);
    k->met = (uint8_t *)delaunay_alloc_zeroed(memory, cap, 1);
    if (!k->slots || !k->met) return SPR_ERROR_OUT_OF_MEMORY;
    for (i = 0; i < k->num_items; i++) {
        const uint32_t *v = k->items + k->size * i;
        for (j = 0; j < k->size; j++)
            if (v[j] >= num_vertices) {
                snprintf(report->message, sizeof report->message,
                         "%s %llu names vertex %lu of %llu",
                         k->size == 3 ? "triangle" : "edge", (unsigned long long)i,
                         (unsigned long)v[j], (unsigned long long)num_vertices);
                return SPR_ERROR_INVALID_ARGUMENT;
            }
        if (v[0] == v[1] || (k->size == 3 && (v[0] == v[2] || v[1] == v[2]))) report->absent++;
        else k->slots[spr__kept_slot(k, v)] = (uint32_t)i + 1;
    }
    return SPR_OK;
}

/* Whether an item has these vertices, which are of the mesh; that item is then met. */
static int spr__kept_has(spr__kept *k, const uint32_t *v)
{
    size_t slot = spr__kept_slot(k, v);
    if (!k->slots[slot]) return 0;
    k->met[slot] = 1;
    return 1;
}

static uint64_t spr__kept_absent(const spr__kept *k)
{
    uint64_t absent = 0;
    size_t i;
    for (i = 0; i <= k->mask; i++) absent += k->slots[i] && !k->met[i];
    return absent;
}

/* Marks the triangles and edges of the options in an imported mesh. */
static spr_result spr__mark_kept(delaunay_mesh *mesh, delaunay_memory *memory,
                                 const spr_options *options, spr_report *report)
{
    spr__kept triangles, edges;
    spr_result result;
    delaunay_handle t;
    uint32_t v[3];
    int i, j;
    memset(&triangles, 0, sizeof triangles);
    memset(&edges, 0, sizeof edges);
    if (!options->num_kept_triangles && !options->num_kept_edges) return SPR_OK;
    triangles.items = options->kept_triangles;
    triangles.num_items = options->num_kept_triangles;
    triangles.size = 3;
    edges.items = options->kept_edges;
    edges.num_items = options->num_kept_edges;
    edges.size = 2;
    result = spr__kept_init(&triangles, memory, mesh->num_points, report);
    if (result == SPR_OK) result = spr__kept_init(&edges, memory, mesh->num_points, report);
    for (t = 1; result == SPR_OK && t < mesh->num_tets; t++) {
        const uint32_t *corner = mesh->tets[t].v;
        unsigned flags = mesh->flags[t];
        for (i = 0; i < 4 && triangles.num_items; i++) {
            for (j = 0; j < 3; j++) v[j] = mesh->vertex_id[corner[delaunay_facet_order(i)[j]]];
            if (spr__kept_has(&triangles, v)) flags |= DELAUNAY_FACET_BIT(i);
        }
        for (i = 0; i < 6 && edges.num_items; i++) {
            for (j = 0; j < 2; j++) v[j] = mesh->vertex_id[corner[delaunay_edge_order(i)[j]]];
            if (spr__kept_has(&edges, v)) flags |= DELAUNAY_EDGE_BIT(i);
        }
        mesh->flags[t] = (uint16_t)flags;
    }
    if (result == SPR_OK)
        report->absent += spr__kept_absent(&triangles) + spr__kept_absent(&edges);
    delaunay_release(memory, triangles.slots);
    delaunay_release(memory, triangles.met);
    delaunay_release(memory, edges.slots);
    delaunay_release(memory, edges.met);
    return result;
}

/* Writes an improved mesh to the caller's arrays. number: scratch, with an entry per vertex. */
static spr_result spr__export(const delaunay_mesh *m, double *xyz, size_t *num_vertices,
                              size_t cap_vertices, uint32_t *tets, uint32_t *colors,
                              size_t *num_tets, size_t cap_tets, uint32_t *number)
{
    size_t n = *num_vertices, count = (size_t)delaunay_count_tets(m), new_ = 0, k = 0;
    delaunay_handle t;
    uint32_t v;
    int i;
    for (v = 1; v < m->num_vertices; v++) new_ += m->vertex_id[v] == DELAUNAY_NO_ID;
    if (count > cap_tets || new_ > cap_vertices - n) return SPR_ERROR_TOO_LARGE;
    for (v = 1; v < m->num_vertices; v++) {
        number[v] = m->vertex_id[v] != DELAUNAY_NO_ID ? m->vertex_id[v] : (uint32_t)n++;
        memcpy(xyz + 3 * (size_t)number[v], m->vertices[v].x, sizeof m->vertices[v].x);
    }
    for (t = 1; t < m->num_tets; t++) {
        if (delaunay_is_deleted(m, t) || delaunay_is_ghost(m, t)) continue;
        for (i = 0; i < 4; i++) tets[4 * k + (size_t)i] = number[m->tets[t].v[i]];
        if (colors) colors[k] = m->color[t] - 1;
        k++;
    }
    *num_vertices = n;
    *num_tets = count;
    return SPR_OK;
}

/* Makes a mesh of the caller's arrays. Its colours are those of the caller plus one; the triangles
 * and edges that are to be kept are marked. */
static spr_result spr__import(delaunay_mesh *mesh, const double *xyz, size_t num_vertices,
                              const uint32_t *tets, const uint32_t *colors, size_t num_tets,
                              delaunay_memory *memory, const spr_options *options,
                              spr_report *report)
{
    delaunay_report import;
    size_t i;
    delaunay_result read = delaunay_import(mesh, xyz, num_vertices, tets, NULL, num_tets,
                                           &options->host, &import);
    if (read != DELAUNAY_OK) {
        snprintf(report->message, sizeof report->message, "%.255s",
                 import.message[0] ? import.message : delaunay_result_string(read));
        return read == DELAUNAY_ERROR_INVALID_MESH || read == DELAUNAY_ERROR_NOT_FINITE
                   ? SPR_ERROR_INVALID_MESH
               : read < -15 ? SPR_ERROR_INVALID_ARGUMENT
                            : (spr_result)read;
    }
    if (delaunay_enable_marks(mesh) != DELAUNAY_OK) return SPR_ERROR_OUT_OF_MEMORY;
    for (i = 0; i < num_tets; i++) mesh->color[i + 1] = colors ? colors[i] + 1 : 1;
    return spr__mark_kept(mesh, memory, options, report);
}

/* Whether no colour is 2^32 - 1: those of the mesh are greater by one. */
static int spr__check_colors(const uint32_t *colors, size_t num_tets, spr_report *report)
{
    size_t i;
    for (i = 0; i < num_tets && colors[i] != UINT32_MAX; i++) {}
    if (i == num_tets) return 1;
    snprintf(report->message, sizeof report->message, "tetrahedron %llu has the colour 2^32 - 1",
             (unsigned long long)i);
    return 0;
}

/* Which vertices of an imported mesh are fixed, by those of the caller, NULL: none. NULL: out of
 * memory. */
static uint8_t *spr__import_fixed(const delaunay_mesh *mesh, delaunay_memory *memory,
                                  const uint8_t *fixed)
{
    uint8_t *mask = (uint8_t *)delaunay_alloc(memory, mesh->num_vertices, 1);
    uint32_t v;
    if (!mask) return NULL;
    for (v = 1, mask[0] = 1; v < mesh->num_vertices; v++) {
        const uint32_t id = mesh->vertex_id[v];
        mask[v] = (uint8_t)(fixed && id != DELAUNAY_NO_ID && fixed[id]);
    }
    return mask;
}

SPR_API spr_result spr_improve_arrays(double *xyz, size_t *num_vertices, size_t cap_vertices,
                                      uint32_t *tets, uint32_t *colors, size_t *num_tets,
                                      size_t cap_tets, const uint8_t *fixed,
                                      const spr_options *options, spr_report *report)
{
    delaunay_mesh mesh;
    delaunay_memory memory;
    spr_options own;
    spr_report unused;
    uint8_t *mask = NULL;
    uint32_t *number = NULL;
    uint64_t absent;
    size_t room;
    spr_result result, written;
    if (!report) report = &unused;
    memset(report, 0, sizeof *report);
    memset(&mesh, 0, sizeof mesh);
    memset(&own, 0, sizeof own);
    if (options) own = *options;
    memset(&memory, 0, sizeof memory);
    result = SPR_ERROR_INVALID_ARGUMENT;
    if (!xyz || !tets || !num_vertices || !num_tets || cap_vertices < *num_vertices ||
        cap_tets < *num_tets) {
        snprintf(report->message, sizeof report->message,
                 "invalid argument: an array or its number is NULL, or there is less room in it "
                 "than it has vertices or tetrahedra");
        goto done;
    }
    result = spr__check_options(&own, report);
    if (result != SPR_OK) goto done;
    result = SPR_ERROR_INVALID_ARGUMENT;
    if (colors && !spr__check_colors(colors, *num_tets, report)) goto done;
    room = cap_vertices - *num_vertices;
    result = (spr_result)delaunay_memory_init(&memory, &own.host);
    if (result != SPR_OK) goto done;
    result = spr__import(&mesh, xyz, *num_vertices, tets, colors, *num_tets, &memory, &own, report);
    if (result != SPR_OK) goto done;
    result = SPR_ERROR_OUT_OF_MEMORY;
    mask = spr__import_fixed(&mesh, &memory, fixed);
    if (!mask) goto done;
    own.fixed_vertices = mask;
    own.free_vertices = 1;
    if (room > UINT32_MAX) room = UINT32_MAX;
    absent = report->absent;
    result = spr__improve_mesh(&mesh, &own, report, (uint32_t)room);
    report->absent = absent;
    if (result < 0 && result != SPR_CANCELLED) goto done;
    number = (uint32_t *)delaunay_alloc(&memory, mesh.num_vertices, sizeof *number);
    written = number ? spr__export(&mesh, xyz, num_vertices, cap_vertices, tets, colors, num_tets,
                                   cap_tets, number)
                     : SPR_ERROR_OUT_OF_MEMORY;
    if (written != SPR_OK) {
        result = written;
        report->message[0] = 0;
    }
done:
    if (result < 0 && !report->message[0])
        snprintf(report->message, sizeof report->message, "%s", spr_result_string(result));
    delaunay_release(&memory, mask);
    delaunay_release(&memory, number);
    delaunay_mesh_free(&mesh);
    return result;
}

#endif /* SPR_IMPLEMENTATION */

/*
This software is available under two licences: choose the one you prefer.

------------------------------------------------------------------------------
ALTERNATIVE A - MIT License

Copyright (c) 2026 the authors of hilbert.h, hxtsort.h, delaunay.h, mesher.h and spr.h

Permission is hereby granted, free of charge, to any person obtaining a copy of
this software and associated documentation files (the "Software"), to deal in
the Software without restriction, including without limitation the rights to
use, copy, modify, merge, publish, distribute, sublicense, and/or sell copies
of the Software, and to permit persons to whom the Software is furnished to do
so, subject to the following conditions:

The above copyright notice and this permission notice shall be included in all
copies or substantial portions of the Software.

THE SOFTWARE IS PROVIDED "AS IS", WITHOUT WARRANTY OF ANY KIND, EXPRESS OR
IMPLIED, INCLUDING BUT NOT LIMITED TO THE WARRANTIES OF MERCHANTABILITY,
FITNESS FOR A PARTICULAR PURPOSE AND NONINFRINGEMENT. IN NO EVENT SHALL THE
AUTHORS OR COPYRIGHT HOLDERS BE LIABLE FOR ANY CLAIM, DAMAGES OR OTHER
LIABILITY, WHETHER IN AN ACTION OF CONTRACT, TORT OR OTHERWISE, ARISING FROM,
OUT OF OR IN CONNECTION WITH THE SOFTWARE OR THE USE OR OTHER DEALINGS IN THE
SOFTWARE.

------------------------------------------------------------------------------
ALTERNATIVE B - Public Domain (www.unlicense.org)

This is free and unencumbered software released into the public domain.

Anyone is free to copy, modify, publish, use, compile, sell, or distribute this
software, either in source code form or as a compiled binary, for any purpose,
commercial or non-commercial, and by any means.

In jurisdictions that recognize copyright laws, the author or authors of this
software dedicate any and all copyright interest in the software to the public
domain. We make this dedication for the benefit of the public at large and to
the detriment of our heirs and successors. We intend this dedication to be an
overt act of relinquishment in perpetuity of all present and future rights to
this software under copyright law.

THE SOFTWARE IS PROVIDED "AS IS", WITHOUT WARRANTY OF ANY KIND, EXPRESS OR
IMPLIED, INCLUDING BUT NOT LIMITED TO THE WARRANTIES OF MERCHANTABILITY,
FITNESS FOR A PARTICULAR PURPOSE AND NONINFRINGEMENT. IN NO EVENT SHALL THE
AUTHORS BE LIABLE FOR ANY CLAIM, DAMAGES OR OTHER LIABILITY, WHETHER IN AN
ACTION OF CONTRACT, TORT OR OTHERWISE, ARISING FROM, OUT OF OR IN CONNECTION
WITH THE SOFTWARE OR THE USE OR OTHER DEALINGS IN THE SOFTWARE.
*/
