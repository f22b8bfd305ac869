/* mesher.h - v0.1.0 - from a triangulated surface to a conforming tetrahedral mesh; the surface
 * comes back bit for bit
 *
 *     #define MESHER_IMPLEMENTATION       // in one file of your program
 *     #include "mesher.h"                 // needs delaunay.h, hilbert.h and hxtsort.h beside it
 *
 *     mesher_surface surface = {0};       // the caller's arrays; not copied, not written
 *     mesher_domain  domain = {0};
 *     mesher_report  report = {0};
 *     surface.xyz = xyz;             surface.num_vertices = nv;
 *     surface.triangles = triangles; surface.num_triangles = nt;
 *     if (mesher_mesh(&domain, &surface, NULL, &report) >= 0) {
 *         mesher_output out = {0};
 *         if (mesher_export(&domain, &out) == MESHER_OK) use(out.xyz, out.tets, out.regions);
 *         mesher_output_free(&domain, &out);
 *     } else puts(report.message);
 *     mesher_domain_free(&domain);
 *
 *     cc -O3 -fopenmp program.c -o program -lm      (also without -fopenmp: one thread)
 *
 * CONTENTS (search for the tag)
 *   >>dependencies    how this file finds delaunay.h
 *   >>types           status codes, surface, options, findings, report, domain, output
 *   >>everyday        check, weld, mesh, divide, export
 *   >>expert          the stages by themselves
 *   >>surface         cheap checks; unique facets and edges
 *   >>check           every defect of a surface, with ids and coordinates
 *   >>empty           Delaunay triangulation of the vertices in a box    [Marot 2020, 5]
 *   >>recover         every edge and facet of the input becomes one of the mesh: what is missing
 *     >>pipes           what a missing edge or facet crosses; windows of the mesh around it
 *     >>flips           of what a missing edge crosses                   [Si 2015]
 *     >>searches        closure searches for edges and facets            [Marot 2020, 6.2]
 *     >>kernels         where a point sees all of a window               [Seidel 1991]
 *     >>planes          flips within a plane of the surface
 *     >>points          Steiner points inside, and their removal
 *     >>splits          points on the surface, for a while               [George et al. 2003]
 *     >>attempts        the order of all these
 *   >>regions         cells, found by flood fill; which of them are kept
 *   >>size            the wanted edge length as a function of the place  [Marot 2020, 7]
 *   >>divide          a surface with shorter edges, before it is meshed  [Rivara 1984]
 *   >>refine          sweeps: points proposed where tetrahedra are large [Marot 2020, 5]
 *     >>lattice         points far from the surface, before all sweeps
 *     >>insert          points filtered, then inserted                   [Marot 2020, 4]
 *     >>sweeps          the whole refinement
 *   >>public          the everyday functions
 *
 * WHAT IT DOES NOT DO
 *   Repair: a surface that intersects itself is refused, and the intersecting pairs are reported;
 *   only mesher_weld merges vertices that rounding has separated. Curved surfaces and elements,
 *   anisotropic sizes, coarsening. The input triangles are kept, so where small sizes are asked for
 *   beside large triangles, the tetrahedra on these are flat: mesher_refine_surface divides such
 *   triangles first, within their planes. On needles too; mesher_flip_surface replaces those that
 *   other diagonals can. Refinement leaves tetrahedra of fair quality; spr.h improves them.
 *
 * WORDS
 *   line      an edge that the caller asks for (mesher_surface.edges), beside those of triangles
 *   facet     a distinct triangle of the surface; duplicates, in either orientation, are one facet
 *   cell      a connected part of space without the facets; the unbounded one is the outside
 *   region    a bounded cell; if it is kept, its tetrahedra are in the output and have its number
 *   sheet     a facet, or several joined, with the same cell on both sides
 *   survivor  of vertices with equal coordinates the first, which stands for all of them
 *   size      wanted edge length
 *   extent    of a surface: the largest difference of its vertices in a coordinate
 *
 * HOW IT WORKS
 *   1. The surface: equal vertices and duplicate triangles are merged; cheap checks.
 *   2. The empty mesh: the Delaunay triangulation of the vertices and the corners of a large box.
 *   3. Recovery. Edges and facets of the surface that the empty mesh lacks are brought in: by flips
 *      of the tetrahedra that they cross, by searches of small windows of the mesh for tetrahedra
 *      with fewer crossings (delaunay_reconnect), by Steiner points inside, and at last by Steiner
 *      points on the surface, which are removed from it again. Every sign is exact. The test for
 *      intersections runs only if recovery takes long, or fails.
 *   4. Regions: the cells, found by flood fill; the depth and the winding number of a cell follow
 *      from the facets between it and the outside.
 *   5. Sizes: set at the vertices and bounded by the gradation; elsewhere interpolated in the mesh
 *      as it was before refinement.
 *   6. Refinement: body-centred lattices, one beside the other, where the sizes allow; then, in
 *      sweeps, points at or near the circumcentres of tetrahedra that are too large or flat. Points
 *      are filtered by a grid, sorted along a space-filling curve, and inserted in star-shaped
 *      cavities that respect the facets. Each thread takes sections of the curve; the sections
 *      depend on the points alone.
 *
 * LIMITS
 *   Coordinates up to 1e60, an extent of 1e-60 at least; 2^32 - 25 vertices, 1.4 * 10^9 triangles
 *   and lines together. The number of tetrahedra is limited as in delaunay.h. A thread needs up to
 *   160 KB of stack.
 *
 * COMPILE-TIME SWITCHES
 *   MESHER_IMPLEMENTATION     implementation file  the bodies (and those of the three it needs)
 *   MESHER_NO_DEPENDENCIES    implementation file  other files have the bodies of those three
 *   MESHER_STATIC             implementation file  everything static
 *   DELAUNAY_NO_SIMD, DELAUNAY_INDEX64: see delaunay.h
 *
 * SOURCES
 *   [George et al. 2003]  P.-L. George, H. Borouchaki, E. Saltel, 'Ultimate' robustness in meshing
 *                         an arbitrary polyhedron, Int. J. Numer. Meth. Engng 58
 *   [Klincsek 1980]       G. T. Klincsek, Minimal triangulations of polygonal domains, Annals of
 *                         Discrete Mathematics 9
 *   [Lawson 1977]         C. L. Lawson, Software for C1 surface interpolation, in: Mathematical
 *                         Software III
 *   [Marot 2020]          C. Marot, Parallel tetrahedral mesh generation, thesis
 *   [Rivara 1984]         M.-C. Rivara, Algorithms for refining triangular grids suitable for
 *                         adaptive and multigrid techniques, Int. J. Numer. Meth. Engng 20
 *   [Seidel 1991]         R. Seidel, Small-dimensional linear programming and convex hulls made
 *                         easy, Discrete & Computational Geometry 6
 *   [Shewchuk 2002]       J. R. Shewchuk, Two discrete optimization algorithms for the topological
 *                         improvement of tetrahedral meshes, manuscript
 *   [Si 2015]             H. Si, TetGen, a Delaunay-based quality tetrahedral mesh generator, ACM
 *                         Transactions on Mathematical Software 41
 *
 * LICENCE: MIT or public domain, at the end of the file.
 * SPDX-License-Identifier: MIT OR Unlicense
 */

/* ---- >>dependencies (outside the guard: a second include may ask for bodies) -------------- */
#if defined(MESHER_IMPLEMENTATION) && !defined(MESHER_NO_DEPENDENCIES) &&                          \
    !defined(DELAUNAY_IMPLEMENTATION)
#  define DELAUNAY_IMPLEMENTATION
#endif
#if defined(MESHER_STATIC) && !defined(DELAUNAY_H)
#  define DELAUNAY_STATIC
#endif
#include "delaunay.h"
#if DELAUNAY_VERSION < 100
#  error "mesher.h needs delaunay.h 0.1.0 or newer"
#endif

#ifndef MESHER_H
#define MESHER_H
#define MESHER_VERSION 100 /* 10000*major + 100*minor + patch */

#ifndef MESHER_API
#  if !defined(MESHER_STATIC)
#    define MESHER_API extern
#  elif defined(__GNUC__)
#    define MESHER_API static __attribute__((unused))
#  else
#    define MESHER_API static
#  endif
#endif

#ifdef DELAUNAY_INDEX64
#  define mesher_mesh           mesher_mesh_index64
#  define mesher_refine_mesh    mesher_refine_mesh_index64
#  define mesher_refine_surface mesher_refine_surface_index64
#  define mesher_flip_surface   mesher_flip_surface_index64
#  define mesher_count_flips    mesher_count_flips_index64
#  define mesher_export         mesher_export_index64
#  define mesher_output_free    mesher_output_free_index64
#  define mesher_domain_free    mesher_domain_free_index64
#  define mesher_domain_init    mesher_domain_init_index64
#  define mesher_empty_mesh     mesher_empty_mesh_index64
#  define mesher_recover        mesher_recover_index64
#  define mesher_color          mesher_color_index64
#  define mesher_region_tags    mesher_region_tags_index64
#  define mesher_size           mesher_size_index64
#  define mesher_refine         mesher_refine_index64
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* ---- >>types ------------------------------------------------------------------------------ */

/* The first eight are those of delaunay_result. Positive: the mesh is valid. */
typedef enum mesher_result {
    MESHER_OK                     = 0,
    MESHER_STOPPED_BY_BUDGET      = 1,
    MESHER_GOAL_NOT_MET           = 2,
    MESHER_ERROR_INVALID_ARGUMENT = -1,
    MESHER_ERROR_OUT_OF_MEMORY    = -2,
    MESHER_CANCELLED              = -3,
    MESHER_ERROR_TOO_LARGE        = -4,
    MESHER_ERROR_INTERNAL         = -5,
    MESHER_ERROR_SURFACE          = -64, /* the surface is invalid: the findings say where */
    MESHER_ERROR_RECOVERY         = -65  /* an edge or facet could not be recovered: findings */
} mesher_result;

/* The caller's surface: plain arrays; triangles in any orientation, any number of shells and
 * sheets. Members that are not used must be zero. */
typedef struct mesher_surface {
    const double   *xyz;            /* 3*num_vertices */
    size_t          num_vertices;
    /* num_vertices flags, or NULL. A vertex with a nonzero flag is left out of the mesh, without a
     * note, unless a triangle or line uses it */
    const uint8_t  *left_out;
    const uint32_t *triangles;      /* 3*num_triangles indices into the vertices */
    const int32_t  *triangle_tags;  /* num_triangles, or NULL: all 1 */
    size_t          num_triangles;
    const uint32_t *edges;          /* 2*num_edges: lines that must be edges of the mesh too */
    const int32_t  *edge_tags;      /* num_edges, or NULL: all 1 */
    size_t          num_edges;
    /* 3*num_seeds: for MESHER_REGIONS_SEEDS, points in cells that are to be kept or removed */
    const double   *seeds;
    /* num_seeds, or NULL: 1, 2, ..; the number of the region around the seed; 0 or less: a hole */
    const int32_t  *seed_tags;
    size_t          num_seeds;
} mesher_surface;

/* Which bounded cells are kept as regions. */
typedef enum mesher_regions {
    MESHER_REGIONS_ALL,     /* every bounded cell is a region of its own */
    /* a cell is kept if its depth, the least number of facets between it and the outside, is odd */
    MESHER_REGIONS_PARITY,
    /* a cell is kept if its winding number, by the facets' orientation, is not 0 */
    MESHER_REGIONS_WINDING,
    /* cells that contain a seed with a tag > 0 are kept; if there is no such seed, all cells but
     * the holes. If a cell contains several seeds, the first one counts. Noted are seeds in no
     * bounded cell, others than the first with another number, and cells left out as they have
     * none. Which cell a seed on a facet is in is not defined */
    MESHER_REGIONS_SEEDS
} mesher_regions;

/* A source asks for its size within radius of its shape; from there on the size grows by slope per
 * unit of length. */
typedef enum mesher_shape {
    MESHER_SHAPE_BALL,    /* the point xyz[0..2]: with the radius, a ball */
    MESHER_SHAPE_BOX,     /* along the axes; xyz[0..2] and xyz[3..5]: any two opposite corners */
    MESHER_SHAPE_SEGMENT, /* between xyz[0..2] and xyz[3..5] */
    MESHER_SHAPE_TRIANGLE /* with corners xyz[0..2], xyz[3..5] and xyz[6..8] */
} mesher_shape;
typedef struct mesher_source {
    mesher_shape shape;
    double xyz[9], radius; /* radius: 0 or more */
    double size;  /* > 0 */
    double slope; /* 0: gradation - 1, or 0.4 without gradation; infinite: nothing beyond */
} mesher_source;

/* Sizes at the nodes of a regular grid, interpolated trilinearly between them; outside the grid,
 * the size at its nearest place. */
typedef struct mesher_size_grid {
    double        origin[3], spacing[3];
    uint32_t      count[3]; /* nodes on each axis, 2 at least */
    /* count[0]*count[1]*count[2], the first axis fastest; <= 0 or NaN: nothing asked for around
     * this node */
    const double *size;
} mesher_size_grid;

/* Sizes at the vertices of a tetrahedral mesh, such as the one that a field was computed on before;
 * interpolated linearly within its tetrahedra; outside all of them, the size at their nearest
 * place. Zero it, set the arrays, which are not copied, and call mesher_size_mesh_init. */
typedef struct mesher_size_mesh {
    const double   *xyz;  size_t num_vertices;
    const uint32_t *tets; size_t num_tets; /* 4 vertices each, in any orientation */
    const double   *size; /* 1 a vertex; <= 0 or NaN: nothing asked for around this vertex */
    void           *tree; /* made by mesher_size_mesh_init */
} mesher_size_mesh;

typedef struct mesher_options {
    delaunay_host  host;
    mesher_regions regions;
    /* end after the regions: only the points that recovery needs are added to the surface's */
    int    no_refine;
    /* where nothing else helps, leave points on edges and facets of the surface; they are counted
     * and listed in the report */
    int    allow_surface_steiner;
    /* no search for intersecting pairs in mesher_check, which then does not look at cells either,
     * nor in mesher_mesh after the cheap checks have found a defect; where recovery takes long or
     * fails, mesher_mesh makes it anyway */
    int    no_intersection_test;
    /* vertices in no triangle or line are left out of the mesh; 0: they are nodes of it */
    int    drop_unused;
    /* facets with the outside on both sides are noted, and in no tetrahedron of the output; 0: they
     * are defects */
    int    drop_outside;
    /* no size is larger; 0: the surface alone decides, and sizes inside are 1.3 times the length of
     * the surface's edges around them. (Where that would leave one layer of flat tetrahedra between
     * two sides of the surface, sizes are 0.7 times as large, unless layers are asked for.) */
    double size;
    /* factor of all sizes but min_size, max_size, and those of layers and curvature; 0: 1. Sizes at
     * the surface's vertices are at most twice the default's, whatever is asked for, or its
     * triangles would have flat or long tetrahedra on them. */
    double size_factor;
    double min_size, max_size;    /* bounds of all sizes; 0: none */
    /* largest ratio of the sizes at both ends of an edge that has the smaller size as its length
     * (sizes grow by gradation - 1 per unit of length); 0: 2 in general, as the lengths of a
     * surface's edges may change abruptly, and 1.4 around sources; else 1 or more */
    double gradation;
    /* > 1: away from the surface sizes grow by this ratio, instead of being interpolated between
     * its sizes: to the least of size + (growth - 1) * distance over the vertices of the region.
     * More than 1.7 acts as 1.7, as more saves hardly a tetrahedron and makes bad ones */
    double growth;
    /* > 0: about so many tetrahedra, or more, between facets that face each other; not between
     * facets that share a vertex, and no smaller than a 64th of a facet's longest edge (this bound
     * does not hold for mesher_refine_surface, which divides such facets) */
    double layers;
    /* > 0: an edge at a curved surface spans at most this angle of it; facets beyond a crease of
     * more than 45 degrees do not count */
    double curvature_degrees;
    /* Sizes that the caller asks for, in arrays and objects that must be there as long as the
     * domain is sized or refined. vertex_sizes: one for each vertex of the surface, instead of 1.3
     * times the mean length of the surface's edges there, and at most 2.6 times it; <= 0 or NaN:
     * the former; NULL: all by the mean.
     * Of these and all the following the minimum counts: region_sizes[number - 1] in each region
     * (<= 0: nothing asked for), sources, a grid, a mesh (or NULL), and size_function. */
    const double           *vertex_sizes;
    const double           *region_sizes; size_t num_region_sizes;
    const mesher_source    *sources;      size_t num_sources;
    const mesher_size_grid *size_grid;
    const mesher_size_mesh *size_mesh;
    /* A size field, asked in batches, by several threads at once; or NULL. out[i] = size at
     * xyz + 3*i, which is in the region of number region[i]; <= 0 or NaN: nothing asked for. The
     * same place must always get the same answer. It is asked at vertices and where a point may
     * come; a small size that grows steeply, with none of these near, may go unnoticed: sources,
     * grids and meshes are searched for such sizes. */
    void (*size_function)(void *user, size_t count, const double *xyz, const uint32_t *region,
                          double *out);
    void  *size_user;
    /* Budgets of refinement; 0: none. There is a valid mesh however small they are. They do not
     * end the stages before refinement; host.progress can cancel these. */
    uint64_t max_vertices, max_tets; double max_seconds;
} mesher_options;

#define MESHER_NEARLY 1e-6 /* of the extent of a surface: see MESHER_NOTE_NEAR_VERTEX */
/* The search for intersecting pairs ends when it has found this many. */
#define MESHER_MOST_PAIRS UINT64_C(10000000)

/* Defects make a surface invalid; notes do not. */
typedef enum mesher_kind {
    MESHER_NOTE_DUPLICATE_VERTEX,   /* vertices[0] has the coordinates of vertices[1] */
    MESHER_NOTE_UNUSED_VERTEX,      /* in no triangle or line; left out if on triangles[0] */
    MESHER_NOTE_REPEATED_INDEX,     /* a triangle or line with equal corners: it is ignored */
    MESHER_NOTE_DUPLICATE_TRIANGLE, /* the same vertices and orientation as another */
    MESHER_NOTE_OPPOSITE_TRIANGLE,  /* the same vertices, turned over */
    MESHER_NOTE_FLIPPED_TRIANGLE,   /* two at an edge that disagree in orientation */
    MESHER_NOTE_OPEN_EDGE,          /* an edge of one facet only */
    MESHER_NOTE_NON_MANIFOLD_EDGE,  /* an edge of more than two facets */
    MESHER_NOTE_SHEET,              /* a facet with the same cell on both sides */
    MESHER_NOTE_SHELL_FILLED,       /* a region within another one that may be meant as a void */
    MESHER_NOTE_SURFACE_STEINER,    /* a point that recovery has left on the surface */
    /* two ends of open edges that differ by MESHER_NEARLY of the surface's extent at most, perhaps
     * by rounding alone; mesher_weld makes them equal */
    MESHER_NOTE_NEAR_VERTEX,
    MESHER_NOTE_OUTSIDE_LINE, /* a line in no kept cell: no tetrahedron of the output has it */
    MESHER_NOTE_OUTSIDE_SEED, /* a seed in no bounded cell: vertices[0] is its number */
    /* seed vertices[0] in the cell of seed vertices[1], which counts, with another region number */
    MESHER_NOTE_SHARED_CELL,
    /* a cell without a seed, left out as others have one; it is beside triangles[0] */
    MESHER_NOTE_UNSEEDED_CELL,
    MESHER_NOTE_OUTSIDE_FACET, /* a facet with the outside on both sides, if these are dropped */
    /* mesher_check: recovery has failed, so what only the cells tell is not known */
    MESHER_NOTE_CELLS_UNKNOWN,
    MESHER_DEFECT_FIRST,
    MESHER_DEFECT_NOT_FINITE = MESHER_DEFECT_FIRST, /* a coordinate: NaN or infinite */
    MESHER_DEFECT_RANGE,        /* a coordinate beyond 1e60, or an extent below 1e-60 */
    MESHER_DEFECT_INDEX,        /* vertices[0] is no vertex */
    MESHER_DEFECT_COLLINEAR,    /* a triangle with its corners on a straight line */
    MESHER_DEFECT_T_JUNCTION,   /* a vertex on an edge or facet that does not have it */
    MESHER_DEFECT_OVERLAP,      /* two facets in one plane whose interiors meet */
    MESHER_DEFECT_INTERSECTION, /* two facets or lines cross each other */
    MESHER_DEFECT_FLAT,         /* all facets lie in one plane */
    MESHER_DEFECT_NO_CELL,      /* the surface encloses no volume */
    MESHER_DEFECT_NONE_KEPT,  /* there are cells, but mesher_options.regions keeps none of them */
    MESHER_DEFECT_OUTSIDE_FACET, /* the same, if they are not */
    MESHER_DEFECT_RECOVERY,     /* an edge or facet that could not be recovered */
    MESHER_DEFECT_NOT_IN_MESH,  /* mesher_refine_mesh: a triangle or line that the mesh lacks */
    MESHER_NUM_KINDS
} mesher_kind;

/* One finding: its kind, the caller's triangles and vertices concerned, and the place. Unused ids
 * are DELAUNAY_NO_ID. The caller's lines are numbered after the triangles: line i has the id
 * num_triangles + i, here and in mesher_domain.edge_source.
 *
 *   T_JUNCTION       vertices[0], of triangles[0], lies on triangles[1]: on its edge from
 *                    vertices[1] to [2], if these are given
 *   OPEN_EDGE, NON_MANIFOLD_EDGE, FLIPPED_TRIANGLE, NO_CELL
 *                    the edge from vertices[0] to [1], of triangles[0] (and [1], if it is given)
 *   COLLINEAR, NOT_IN_MESH, RECOVERY
 *                    all vertices given are of triangles[0]; RECOVERY: what is missing, or a piece
 *   INDEX, REPEATED_INDEX
 *                    vertices[0] is the number of triangles[0] that is not as it should be
 *   OVERLAP, INTERSECTION, DUPLICATE_ and OPPOSITE_TRIANGLE
 *                    the pair; vertices, if any are given, are of one of the two
 *   all others       triangles[0], or vertices as they are described above */
typedef struct mesher_finding {
    mesher_kind kind;
    uint32_t    triangles[2];
    uint32_t    vertices[3];
    double      xyz[3];
} mesher_finding;

typedef struct mesher_report {
    /* in: the caller's room for findings. As many as fit are kept, defects before notes; all are
     * counted */
    mesher_finding *findings;
    size_t          cap_findings;
    /* out */
    uint64_t input_vertices, input_triangles; /* of the surface */
    size_t   num_findings;                   /* written to findings */
    /* findings of each kind, kept or not; a stage that is run again adds its own again */
    uint64_t counts[MESHER_NUM_KINDS];
    uint64_t num_vertices, num_tets, num_regions; /* of the output */
    uint64_t missing_edges, missing_facets;  /* of the surface: those that the empty mesh lacks */
    uint64_t interior_steiner, surface_steiner; /* points of recovery that stay */
    uint64_t refined_vertices, refinement_sweeps; /* vertices that refinement added; its sweeps */
    /* answers of the size function that are no size: NaN, 0, negative */
    uint64_t size_ignored;
    double seconds_check, seconds_empty, seconds_recover, seconds_regions, seconds_size,
        seconds_refine;
    double   seconds_detect;                 /* part of recovery: the search for what is missing */
    /* length / wanted length (the mean of the sizes at both ends) of edges with an end that
     * refinement has added, or of a sample of these: percentiles, and their share within
     * [0.7, 1.4] (1 if there are none) */
    double   size_p10, size_p50, size_p90, size_in_band;
    size_t   peak_bytes;
    /* a sentence: what is wrong and where, or which budget ended the call; empty on MESHER_OK (if
     * a stage fails for another reason than the surface it may be empty, too) */
    char     message[512];
} mesher_report;

/* A bounded cell. After mesher_refine_mesh a region of the caller's; then first_facet, depth and
 * winding say nothing. */
typedef struct mesher_region {
    uint32_t number;        /* colour of its tetrahedra, 1 ..; 0: not kept */
    uint32_t first_facet;   /* smallest of the caller's triangles on its boundary, or NO_ID */
    /* least number of facets between it and the outside; 1: it touches the outside */
    uint32_t depth;
    int      winding;       /* winding number of the facets around it */
    int      kept;
    uint64_t num_tets;      /* before refinement */
    double   volume;
} mesher_region;

/* The use of an input vertex: mesher_domain.vertex_used. */
enum {
    /* no vertex of the mesh: a duplicate, or isolated and left out (exactly on a facet or line, or
     * not wanted) */
    MESHER_VERTEX_ABSENT,
    MESHER_VERTEX_SURFACE,  /* in a facet or line */
    /* in neither: an embedded point of the mesh. Outside of the kept cells no tetrahedron of the
     * output has it */
    MESHER_VERTEX_ISOLATED
};

/* A domain: the mesh with its constraints, passed from stage to stage. Zero-initialise. Its members
 * may be read freely. Input vertices are the caller's, by their index. */
typedef struct mesher_domain {
    mesher_surface  surface;      /* the caller's; its arrays must stay alive */
    mesher_options  options;      /* resolved */
    /* input vertex i is vertex mesh.vertex_of[i]; the ids after those of the input vertices are the
     * 8 corners of the box */
    delaunay_mesh   mesh;
    /* 3*num_facets: the facets, sorted, each with ascending survivors as corners */
    uint32_t       *facets;
    uint32_t       *facet_source; /* smallest of the caller's triangles with these corners */
    uint32_t        num_facets;
    /* 2*num_edges: distinct edges of facets and lines, sorted, each with ascending survivors */
    uint32_t       *edges;
    uint32_t       *edge_source;  /* a triangle that has it, or num_triangles + line */
    uint32_t        num_edges;
    uint32_t       *survivor;     /* input vertex -> first input vertex with the same coordinates */
    /* input vertex -> MESHER_VERTEX_..; those that are not ABSENT go into the triangulation */
    uint8_t        *vertex_used;
    /* size at each mesh vertex; NULL before mesher_size. If anything but mesher_refine has changed
     * the vertices since (such as spr_improve), call mesher_size again before mesher_refine; where
     * their number has changed, mesher_refine does that itself */
    double         *size;
    uint32_t        num_sizes;    /* the mesh vertices that size was set for */
    /* for the vertices that mesher_size has seen: the size before the gradation and options.size
     * and max_size bounded it, and the vertex whose size bounds it by the gradation (or the vertex
     * itself) */
    double         *own_size;
    uint32_t       *size_source;
    uint32_t        num_own_sizes;
    uint32_t        cap_size;
    mesher_region  *regions;      /* every bounded cell */
    uint32_t        num_regions;
    /* 2*num_facets: the cells behind and in front of the source triangle (its corners are
     * counter-clockwise as seen from in front), as index in regions plus 1; 0: the outside;
     * DELAUNAY_NO_ID: unknown. NULL before mesher_color */
    uint32_t       *facet_sides;
    uint32_t        first_corner; /* id of box corner 0: the number of input vertices */
    uint32_t        surface_steiner; /* points left on facets and lines, which they cut in pieces */
    /* the mesh is the caller's (mesher_refine_mesh): default sizes are those of all its edges */
    int             keeps_mesh;
    int             is_checked;   /* the intersection test has been made since recovery began */
    int             stage;
    delaunay_memory memory;       /* account of the arrays above; the mesh has its own */
} mesher_domain;

/* The mesh as plain arrays. Vertices: all input vertices in input order (duplicates and unused ones
 * too, though no tetrahedron has them), then the new ones in canonical order. A vertex of the mesh
 * is where the mesh has it: input vertices only move if something other than this header moves
 * them, such as spr.h with free_vertices; duplicates move with their survivors. Input vertices that
 * are not in the mesh are where they were given. Triangles: one for each facet, with the
 * orientation of the first of the caller's triangles with these corners; survivors stand for their
 * duplicates. If points were left on the surface, it is in pieces, and there are neither triangles
 * nor edges. */
typedef struct mesher_output {
    double   *xyz;       uint64_t num_vertices;
    uint32_t *tets;      uint64_t num_tets;      /* 4*num_tets; positive as in delaunay.h */
    uint32_t *regions;                           /* num_tets: the region's number */
    uint32_t *triangles; uint64_t num_triangles; /* 3*num_triangles */
    uint32_t *triangle_source;                   /* num_triangles: that triangle of the caller's */
    int32_t  *triangle_tags;                     /* num_triangles: its tag */
    /* 2*num_triangles: numbers of the regions behind and in front of it (its corners are
     * counter-clockwise as seen from in front); 0: the outside, or a cell that is not kept; both 0:
     * no tetrahedron has it */
    uint32_t *triangle_regions;
    /* 2*num_edges: the caller's lines, in order, also those whose ends are equal */
    uint32_t *edges;     uint64_t num_edges;
    int32_t  *edge_tags;                         /* num_edges */
    delaunay_memory memory;
} mesher_output;

/* A surface whose triangles were divided, as new arrays; the caller's vertices come first. */
typedef struct mesher_fine_surface {
    /* what to mesh next: it refers to the arrays below and to the caller's seeds */
    mesher_surface surface;
    double   *xyz;
    double   *vertex_sizes;     /* those of the options, interpolated; NULL if they have none */
    uint32_t *triangles;
    int32_t  *triangle_tags;
    uint32_t *triangle_source;  /* the caller's triangle that it is part of, or one in its plane */
    uint32_t *edges;
    int32_t  *edge_tags;
    uint32_t *edge_source;      /* number of the caller's line that it is a part of, from 0 on */
    uint8_t  *left_out;         /* NULL if the caller's surface has none */
    uint64_t  num_flips;        /* of diagonals, also of the new triangles */
    delaunay_memory memory;
} mesher_fine_surface;

/* ---- >>everyday --------------------------------------------------------------------------- */

DELAUNAY_INLINE int mesher_is_defect(mesher_kind kind) { return kind >= MESHER_DEFECT_FIRST; }
/* Are the counts of a report exact? 0: those of intersecting pairs (T-junctions, overlaps and
 * intersections) are lower bounds. */
DELAUNAY_INLINE int mesher_counts_all(const mesher_report *report)
{
    return report->counts[MESHER_DEFECT_T_JUNCTION] + report->counts[MESHER_DEFECT_OVERLAP] +
               report->counts[MESHER_DEFECT_INTERSECTION] <
           MESHER_MOST_PAIRS;
}
MESHER_API const char *mesher_result_string(mesher_result result);
MESHER_API const char *mesher_kind_string(mesher_kind kind);
/* One finding of a report as a sentence with ids and coordinates, cut off after size - 1 bytes. */
MESHER_API void mesher_finding_string(char *text, size_t size, const mesher_report *report,
                                      const mesher_finding *finding);

/* Finds the defects of a surface, by exact arithmetic, and makes the notes that need no mesh, with
 * ids and coordinates. The search for intersecting pairs keeps the first million, and ends at
 * MESHER_MOST_PAIRS. A surface without defects that has edges of one or more than two facets,
 * or whose regions are chosen by seeds or winding numbers, is meshed without refinement, to find
 * what only its cells tell: MESHER_DEFECT_OUTSIDE_FACET and _NONE_KEPT, and the notes of sheets,
 * filled shells, lines and seeds outside; of other surfaces mesher_mesh alone makes these notes.
 * Returns MESHER_OK if there is no defect; if such a mesh could not be made, with
 * MESHER_NOTE_CELLS_UNKNOWN. */
MESHER_API mesher_result mesher_check(const mesher_surface *surface, const mesher_options *options,
                                      mesher_report *report);
/* Moves vertices that rounding has separated onto each other. In their order, each vertex moves to
 * the first of those that have stayed from which it differs by no more than the distance in all
 * three coordinates; if there is none, it stays. Call this before mesher_check or mesher_mesh: they
 * merge equal vertices, and note triangles that have become an edge or a point.
 *
 *   xyz        in/out 3*num_vertices; vertices that are not finite or beyond 1e60 stay
 *   distance   in     1e-60 at least, in the unit of xyz: well below the shortest edge
 *   host       in     NULL: defaults
 *   num_moved  out    number of vertices whose coordinates have changed; may be NULL
 *
 * Returns   MESHER_OK; _ERROR_INVALID_ARGUMENT, _ERROR_TOO_LARGE, _ERROR_OUT_OF_MEMORY: xyz is
 *           unchanged
 * Cost      12 to 20 bytes and about 0.2 microseconds a vertex, in one thread */
MESHER_API mesher_result mesher_weld(double *xyz, size_t num_vertices, double distance,
                                     const delaunay_host *host, uint64_t *num_moved);
/* All stages: a surface in, a refined mesh with regions out. Continue with spr_improve, if wanted,
 * and mesher_export.
 *
 *   domain    out   overwritten, so free one that is in use first (this holds for the outputs of
 *                   the functions below, too); on failure zeroed
 *   surface   in    must live as long as the domain
 *   options   in    NULL or zeroed: defaults
 *   report    out   may be NULL; its members findings and cap_findings are in
 *
 * Returns   MESHER_OK; _STOPPED_BY_BUDGET: the mesh is valid all the same; also where
 *           host.memory_limit_bytes ends refinement; _ERROR_SURFACE, _ERROR_RECOVERY: the findings
 *           say where; _ERROR_INVALID_ARGUMENT, _ERROR_OUT_OF_MEMORY, _CANCELLED,
 *           _ERROR_TOO_LARGE, _ERROR_INTERNAL
 * Cost      0.5 to 1.5 us a tetrahedron where it refines
 * Threads   options->host.num_threads; distinct domains may be made at once
 * Repeats   same bytes for any number of threads, unless max_seconds or a memory limit ends it
 * Source    Marot 2020, chapters 5 and 7 */
MESHER_API mesher_result mesher_mesh(mesher_domain *domain, const mesher_surface *surface,
                                     const mesher_options *options, mesher_report *report);
/* Refines a finished tetrahedral mesh: its vertices stay, as do the facets and edges below, and
 * points are added where the sizes ask for them. The default size at a vertex is the mean length of
 * its edges in the mesh, so unless the options ask for smaller sizes almost nothing is added.
 *
 *   domain    out   as mesher_mesh leaves it; on failure zeroed
 *   surface   in    the vertices; the triangles and lines to keep and export, all of which must be
 *                   facets and edges of the mesh: those of the border and between regions (which
 *                   are kept in any case), and any others
 *   tets      in    4*num_tets indices of vertices; all of the same orientation, joined facet to
 *                   facet; parts of the mesh may touch in no more than an edge or a vertex.
 *                   mesher_export gives equal vertices the number of the first one
 *   regions   in    num_tets region numbers other than 0, or NULL: all 1; domain->regions lists
 *                   those that occur, ascending
 *   options   in    NULL or zeroed: defaults; options.regions and what concerns recovery is ignored
 *   report    out   may be NULL
 *
 * Returns   as mesher_mesh; _ERROR_INVALID_ARGUMENT also if tetrahedra are flat, of different
 *           orientation, or two on the same side of a facet (other overlaps are not looked for);
 *           _ERROR_SURFACE: a triangle or line is not in the mesh (findings)
 * Threads, Repeats   as mesher_mesh */
MESHER_API mesher_result mesher_refine_mesh(mesher_domain *domain, const mesher_surface *surface,
                                            const uint32_t *tets, const uint32_t *regions,
                                            size_t num_tets, const mesher_options *options,
                                            mesher_report *report);
/* Makes a surface of the same shape whose edges are as short as the sizes ask for. It is for those
 * who do not need their own triangles back: tetrahedra on triangles that are much larger than
 * themselves cannot be good. Edges more than 1.4 times as long as wanted are halved, the longest in
 * relation to its size first; but an edge that bounds its plane, passes close to the middle of such
 * an edge, and is at least half as long as is wanted there, is halved before it. Diagonals are
 * flipped between triangles of the same tag in one plane: the angle between these is 1e-4 radians
 * at most, or 0.1 at most if the four corners are within a ten millionth of the surface's extent of
 * a plane. Needles without neighbours in their plane keep their length. Lines are divided too, and
 * equal vertices are merged.
 *
 *   fine      out   fine->surface is what to mesh next; on failure zeroed
 *   surface   in    may have any tags, sheets and lines
 *   options   in    all sizes count: to know them the surface is meshed once, without refinement;
 *                   size_function is also asked for region 0. When meshing fine->surface, use
 *                   fine->vertex_sizes as vertex_sizes
 *   report    out   may be NULL
 *
 * Returns   MESHER_OK; _STOPPED_BY_BUDGET: by half of max_vertices, by max_seconds, by half as many
 *           triangles as max_tets, or by a quarter of host.memory_limit_bytes; the surface is valid
 *           all the same; _ERROR_TOO_LARGE, without budgets: to fill it, the sizes ask for more
 *           tetrahedra than there are numbers for; others as mesher_mesh, with findings
 * Cost      of a mesh without refinement, and a microsecond or two for each triangle made, in one
 *           thread
 * Repeats   same bytes for any number of threads, unless max_seconds or a memory limit ends it */
MESHER_API mesher_result mesher_refine_surface(mesher_fine_surface *fine,
                                               const mesher_surface *surface,
                                               const mesher_options *options,
                                               mesher_report *report);
/* Flips diagonals as mesher_refine_surface does, and divides nothing: a surface of the same shape,
 * vertices and number of triangles (but for those that have a corner twice). Between the borders
 * of a plane, of tags, and lines, the triangulation becomes constrained Delaunay. On fewer needles
 * fewer tetrahedra are bad. Equal vertices are merged.
 *
 *   options   in    no size has an effect; of vertex_sizes fine has a copy
 *   The other parameters, and what it returns, are as for mesher_refine_surface, but no budget
 *   ends it.
 * Cost      of a mesh without refinement
 * Repeats   same bytes for any number of threads */
MESHER_API mesher_result mesher_flip_surface(mesher_fine_surface *fine,
                                             const mesher_surface *surface,
                                             const mesher_options *options,
                                             mesher_report *report);
/* Counts the diagonals that mesher_flip_surface would flip at first, before others follow.
 *
 *   domain  in      after mesher_mesh or mesher_domain_init
 *   count   out     0 on failure
 *
 * Returns   MESHER_OK, _ERROR_OUT_OF_MEMORY; _ERROR_INVALID_ARGUMENT: the domain has no surface
 * Cost      about 0.5 microseconds and 90 bytes a triangle
 * Threads   as mesher_mesh */
MESHER_API mesher_result mesher_count_flips(mesher_domain *domain, uint64_t *count);
MESHER_API void mesher_fine_surface_free(mesher_fine_surface *fine);
/* Copies the mesh into plain arrays, which do not depend on the domain. The domain's tetrahedra are
 * put in canonical order (delaunay_canonicalize).
 *
 *   domain  in/out  after mesher_mesh, mesher_refine_mesh or mesher_color, with or without changes
 *                   by spr.h since
 *   out     out     on failure zeroed
 *
 * Returns   MESHER_OK; _ERROR_INVALID_ARGUMENT: no regions yet; _ERROR_OUT_OF_MEMORY
 * Cost      about 0.1 microseconds and 20 bytes a tetrahedron
 * Threads   as mesher_mesh */
MESHER_API mesher_result mesher_export(mesher_domain *domain, mesher_output *out);
/* The domain may be NULL, or freed already. */
MESHER_API void mesher_output_free(mesher_domain *domain, mesher_output *out);
MESHER_API void mesher_domain_free(mesher_domain *domain);
/* Prepares a size mesh for options.size_mesh: makes the tree of bounding boxes by which it is
 * searched. Its arrays and the tree must be there as long as domains that use them are sized or
 * refined. A size mesh that was prepared before is freed first.
 *
 *   mesh     in/out  the arrays set by the caller, the rest zero
 *   host     in      NULL: defaults; its allocator is kept until mesher_size_mesh_free
 *   report   out     may be NULL; the message says what is wrong
 *
 * Returns   MESHER_OK; _ERROR_INVALID_ARGUMENT: no tetrahedra, or one with a corner that does not
 *           exist or is not within 1e60 of 0, an extent below 1e-60, or a wrong host;
 *           _ERROR_OUT_OF_MEMORY; _ERROR_TOO_LARGE: 2^32 tetrahedra or more. After an error there
 *           is nothing to free
 * Cost      that of sorting the tetrahedra; 16 to 28 bytes for each stay, up to 110 meanwhile
 * Threads   host->num_threads; afterwards any number may search the size mesh at once */
MESHER_API mesher_result mesher_size_mesh_init(mesher_size_mesh *mesh, const delaunay_host *host,
                                               mesher_report *report);
/* Releases the tree; the arrays are the caller's. mesh may be NULL. */
MESHER_API void mesher_size_mesh_free(mesher_size_mesh *mesh);
/* Checks options and fills in defaults; MESHER_ERROR_INVALID_ARGUMENT if one is out of range. in
 * may be NULL: all defaults. */
MESHER_API mesher_result mesher_options_resolve(mesher_options *out, const mesher_options *in);

/* ---- >>expert: the stages, in order; each takes the domain valid and leaves it so ----------
 * A stage called before those that it needs returns MESHER_ERROR_INVALID_ARGUMENT and changes
 * nothing; so do mesher_empty_mesh and mesher_recover when called a second time (mesher_color,
 * mesher_size and mesher_refine may be called again). After any other error the domain can only be
 * freed, by mesher_domain_free. */

/* Cheap checks, survivors of duplicate vertices, distinct facets and edges. */
MESHER_API mesher_result mesher_domain_init(mesher_domain *domain, const mesher_surface *surface,
                                            const mesher_options *options, mesher_report *report);
/* The Delaunay triangulation of the vertices and of the corners of a box around them. */
MESHER_API mesher_result mesher_empty_mesh(mesher_domain *domain, mesher_report *report);
/* Makes every edge and facet of the domain one of the mesh, and marks it as constrained in all of
 * its tetrahedra. Several threads look for what is missing and, if that is about 64 edges or more,
 * recover most of it; the mesh is the same as with one thread. */
MESHER_API mesher_result mesher_recover(mesher_domain *domain, mesher_report *report);
/* Finds the cells, fills domain->regions, and gives each tetrahedron the number of its region as
 * colour; those in no kept cell get DELAUNAY_OUTSIDE. Not after mesher_refine_mesh: there the
 * numbers are the caller's. */
MESHER_API mesher_result mesher_color(mesher_domain *domain, mesher_report *report);
/* The distinct tags of the triangles around region i (an index in domain->regions), ascending, as
 * many as there is room for; *count: the number of all of them. tags may be NULL.
 * Returns  MESHER_OK; _ERROR_INVALID_ARGUMENT: no such region, or no mesher_color before (so after
 *          mesher_refine_mesh); _ERROR_OUT_OF_MEMORY */
MESHER_API mesher_result mesher_region_tags(mesher_domain *domain, uint32_t i, int32_t *tags,
                                            size_t cap, size_t *count);
/* Computes the sizes at the vertices, domain->size. */
MESHER_API mesher_result mesher_size(mesher_domain *domain, mesher_report *report);
/* The size that a source, a grid or a mesh (of the latter two, 0: none) asks for at x. The time of
 * a search in a mesh grows with the logarithm of its size, unless most of its tetrahedra are
 * smaller than 1e-7 of its extent. */
MESHER_API double mesher_source_size(const mesher_source *source, double gradation,
                                     const double *x);
MESHER_API double mesher_size_grid_at(const mesher_size_grid *grid, const double *x);
MESHER_API double mesher_size_mesh_at(const mesher_size_mesh *mesh, const double *x);
/* Inserts points until edges have about the wanted length. It begins with mesher_size, if that has
 * not been called or something else has changed the number of vertices since. If called again, it
 * may insert more. */
MESHER_API mesher_result mesher_refine(mesher_domain *domain, mesher_report *report);
/* Extracts a small part of a surface on which mesher_mesh fails in the same way as on the whole, to
 * be sent with a report of the failure.
 *
 *   failure        in      what mesher_mesh returned: MESHER_ERROR_RECOVERY or _SURFACE
 *   where          in      3 doubles: where it failed, such as findings[0].xyz
 *   xyz, triangles out     room for 3*(num_vertices + 8) doubles, 3*(num_triangles + 12) indices
 *   part           out     made of these arrays: triangles near the place, and a box around them
 *                          (the last 12 triangles)
 *
 * Returns  MESHER_OK; MESHER_GOAL_NOT_MET: no small part fails by itself, and part holds the
 *          triangles nearest to the place; _ERROR_OUT_OF_MEMORY, _ERROR_INVALID_ARGUMENT,
 *          _ERROR_TOO_LARGE, _CANCELLED
 * Cost     up to 100 runs on parts of at most 4096 triangles; it ends after half a minute
 * Repeats  same bytes for any number of threads, if the time suffices */
MESHER_API mesher_result mesher_reproduce(const mesher_surface *surface,
                                          const mesher_options *options, mesher_result failure,
                                          const double *where, double *xyz, uint32_t *triangles,
                                          mesher_surface *part);
/* Adds a finding to a report (which may be NULL). */
MESHER_API void mesher_report_add(mesher_report *report, mesher_kind kind, uint32_t triangle0,
                                  uint32_t triangle1, uint32_t vertex0, uint32_t vertex1,
                                  uint32_t vertex2, const double *xyz);

#  ifdef __cplusplus
}
#endif
#endif /* MESHER_H */

/* ============================================================================================
 * Readers of the interface can stop here.
 * ============================================================================================ */
#if defined(MESHER_IMPLEMENTATION) && !defined(MESHER_IMPLEMENTATION_DONE)
#define MESHER_IMPLEMENTATION_DONE
#include <limits.h> /* LONG_MAX only */
#include <math.h>
#include <stdio.h> /* snprintf only */
#include <stdlib.h> /* qsort only */
#include <string.h>
#if defined(__GNUC__) && defined(__x86_64__) && !defined(DELAUNAY_NO_SIMD)
#  include <immintrin.h>
#endif
#if defined(_OPENMP) && defined(__GNUC__)
#  include <omp.h>
#  define MESHER__OMP(directive) _Pragma(#directive)
#  define MESHER__THREAD()       omp_get_thread_num()
/* Access to what several threads may read and write at once; the order does not matter. */
#  define MESHER__FETCH(p)    __atomic_load_n((p), __ATOMIC_RELAXED)
#  define MESHER__STORE(p, x) __atomic_store_n((p), (x), __ATOMIC_RELAXED)
#else
#  define MESHER__OMP(directive)
#  define MESHER__THREAD()    0
#  define MESHER__FETCH(p)    (*(p))
#  define MESHER__STORE(p, x) (*(p) = (x))
#endif

/* ---- >>surface ---------------------------------------------------------------------------- */

/* With coordinates up to this, the predicates are exact, and fifth powers of differences of
 * coordinates are finite. */
#  define MESHER__LARGEST_COORDINATE 1e60
#  define MESHER__SMALLEST_EXTENT    1e-60

static const double *mesher__point(const mesher_surface *surface, uint32_t v)
{
    return surface->xyz + 3 * (size_t)v;
}

/* n = (b - a) x (c - a). Returns its length. */
static double mesher__normal(const double *a, const double *b, const double *c, double *n)
{
    int k;
    for (k = 0; k < 3; k++) {
        int p = (k + 1) % 3, q = (k + 2) % 3;
        n[k] = (b[p] - a[p]) * (c[q] - a[q]) - (b[q] - a[q]) * (c[p] - a[p]);
    }
    return sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
}

static void *mesher__sort_alloc(void *user, size_t size)
{
    return delaunay_alloc((delaunay_memory *)user, size, 1);
}
static void mesher__sort_release(void *user, void *block)
{
    delaunay_release((delaunay_memory *)user, block);
}

/* A key of an unordered pair. */
static uint64_t mesher__pair(uint32_t a, uint32_t b)
{
    return a < b ? (uint64_t)a << 32 | b : (uint64_t)b << 32 | a;
}

/* Moves the array, to which *array points, to a new block with room for want elements; the first
 * keep elements are copied. Returns 0 without memory. */
static int mesher__grow(delaunay_memory *memory, void *array, size_t *cap, size_t keep, size_t want,
                        size_t size)
{
    void *old, *block;
    memcpy(&old, array, sizeof old);
    block = delaunay_grow(memory, old, keep, want, size);
    if (!block) return 0;
    memcpy(array, &block, sizeof block);
    *cap = want;
    return 1;
}

/* Grows such an array if it has no room for need elements, to some more than that. */
static int mesher__room(delaunay_memory *memory, void *array, size_t *cap, size_t keep, size_t need,
                        size_t size)
{
    return need <= *cap || mesher__grow(memory, array, cap, keep, need + need / 2 + 64, size);
}

/* Sorts pairs by key; the sort is stable. */
static mesher_result mesher__sort_pairs(delaunay_memory *memory, int num_threads,
                                        hxtsort_pair *pairs, size_t count)
{
    hxtsort_options options;
    memset(&options, 0, sizeof options);
    options.num_threads = num_threads;
    options.allocator.alloc = mesher__sort_alloc;
    options.allocator.release = mesher__sort_release;
    options.allocator.user = memory;
    return (mesher_result)hxtsort_pairs(pairs, count, &options);
}

static mesher_result mesher__sort(mesher_domain *domain, hxtsort_pair *pairs, size_t count)
{
    return mesher__sort_pairs(&domain->memory, domain->options.host.num_threads, pairs, count);
}

/* mesher_domain.stage: the last stage that the domain has been through; 0: none, or its arrays were
 * filled by hand. */
enum {
    MESHER__STAGE_FAILED = -1,
    MESHER__STAGE_INIT = 1,
    MESHER__STAGE_EMPTY,
    MESHER__STAGE_RECOVERED,
    MESHER__STAGE_COLORED
};

static int mesher__is_colored(const mesher_domain *domain)
{
    return domain && (domain->stage == 0 || domain->stage >= MESHER__STAGE_COLORED) &&
           domain->mesh.color && domain->mesh.flags && domain->mesh.num_vertices > 1;
}

static int mesher__progress(const mesher_options *options, const char *phase, double fraction)
{
    const delaunay_host *host = &options->host;
    return host->progress && host->progress(host->user, phase, fraction);
}

static uint64_t mesher__count_defects(const mesher_report *report)
{
    uint64_t n = 0;
    int k;
    for (k = MESHER_DEFECT_FIRST; k < MESHER_NUM_KINDS; k++) n += report->counts[k];
    return n;
}

/* Clears all of a report but the caller's room for findings. The surface may be NULL. */
static void mesher__report_reset(mesher_report *report, const mesher_surface *surface)
{
    mesher_finding *findings = report->findings;
    size_t cap = report->cap_findings;
    memset(report, 0, sizeof *report);
    report->findings = findings;
    report->cap_findings = findings ? cap : 0;
    if (!surface) return;
    report->input_vertices = surface->num_vertices;
    report->input_triangles = surface->num_triangles;
}

static void mesher__say(mesher_report *report, const char *text)
{
    if (report) snprintf(report->message, sizeof report->message, "%s", text);
}

/* What ends a call with MESHER_STOPPED_BY_BUDGET. */
enum {
    MESHER__BUDGET_VERTICES = 1,
    MESHER__BUDGET_TETS,
    MESHER__BUDGET_SECONDS,
    MESHER__BUDGET_MEMORY,
    MESHER__BUDGET_INDICES
};

static void mesher__say_budget(mesher_report *report, const char *what, int budget,
                               const mesher_options *o)
{
    char name[64] = "the number of vertices or tetrahedra that indices can hold";
    if (budget == MESHER__BUDGET_VERTICES)
        snprintf(name, sizeof name, "max_vertices, %.20g", (double)o->max_vertices);
    if (budget == MESHER__BUDGET_TETS)
        snprintf(name, sizeof name, "max_tets, %.20g", (double)o->max_tets);
    if (budget == MESHER__BUDGET_SECONDS)
        snprintf(name, sizeof name, "max_seconds, %.9g", o->max_seconds);
    if (budget == MESHER__BUDGET_MEMORY)
        snprintf(name, sizeof name, "host.memory_limit_bytes, %.20g",
                 (double)o->host.memory_limit_bytes);
    if (report)
        snprintf(report->message, sizeof report->message, "%s was stopped by a budget: %s", what,
                 name);
}

/* Reports that a call was made without a surface or without a place for the result. */
static mesher_result mesher__refuse(mesher_report *report)
{
    if (report) mesher__report_reset(report, NULL);
    mesher__say(report, "invalid argument: no surface, or no place for the result, was given");
    return MESHER_ERROR_INVALID_ARGUMENT;
}

/* "triangle 12" or "line 3" */
static void mesher__name(char name[32], const mesher_report *report, uint32_t id)
{
    if (id == DELAUNAY_NO_ID) name[0] = 0;
    else if (id < report->input_triangles) snprintf(name, 32, "triangle %lu", (unsigned long)id);
    else snprintf(name, 32, "line %lu", (unsigned long)(id - report->input_triangles));
}

/* A note as a sentence; below, a defect. a and b are the names of the triangles, at is the place in
 * words. */
static void mesher__note_sentence(char *text, size_t size, const mesher_finding *f,
                                  const char *a, const char *b, const char *at)
{
    const unsigned long u = f->vertices[0], v = f->vertices[1];
    switch (f->kind) {
    case MESHER_NOTE_DUPLICATE_VERTEX:
        snprintf(text, size, "vertex %lu has the coordinates of vertex %lu %s", u, v, at);
        break;
    case MESHER_NOTE_UNUSED_VERTEX:
        if (a[0])
            snprintf(text, size, "isolated vertex %lu lies exactly on %s %s and is left out", u, a,
                     at);
        else snprintf(text, size, "vertex %lu %s is in no triangle or line", u, at);
        break;
    case MESHER_NOTE_REPEATED_INDEX:
        snprintf(text, size, "%s has vertex %lu twice, %s", a, u, at);
        break;
    case MESHER_NOTE_DUPLICATE_TRIANGLE:
        snprintf(text, size, "%s is there again as %s", a, b);
        break;
    case MESHER_NOTE_OPPOSITE_TRIANGLE:
        snprintf(text, size, "%s is there again as %s, turned over", a, b);
        break;
    case MESHER_NOTE_FLIPPED_TRIANGLE:
        snprintf(text, size, "%s and %s are oriented against each other at their edge %lu-%lu", a,
                 b, u, v);
        break;
    case MESHER_NOTE_OPEN_EDGE:
        snprintf(text, size, "edge %lu-%lu of %s is in no other triangle, %s", u, v, a, at);
        break;
    case MESHER_NOTE_NON_MANIFOLD_EDGE:
        snprintf(text, size, "edge %lu-%lu of %s is in more than two triangles, %s", u, v, a, at);
        break;
    case MESHER_NOTE_SHEET:
        snprintf(text, size, "%s has the same cell on both sides, %s", a, at);
        break;
    case MESHER_NOTE_SHELL_FILLED:
        snprintf(text, size, "the shell of %s lies inside another one, and is filled", a);
        break;
    case MESHER_NOTE_SURFACE_STEINER:
        snprintf(text, size, "a point was added to %s %s", a, at);
        break;
    case MESHER_NOTE_NEAR_VERTEX:
        snprintf(text, size, "vertices %lu and %lu, ends of open edges, are almost one point %s", u,
                 v, at);
        break;
    case MESHER_NOTE_OUTSIDE_LINE:
        snprintf(text, size, "%s lies in no cell that is kept, %s", a, at);
        break;
    case MESHER_NOTE_OUTSIDE_SEED:
        snprintf(text, size, "seed %lu %s is in no bounded cell", u, at);
        break;
    case MESHER_NOTE_SHARED_CELL:
        snprintf(text, size, "seed %lu %s is in the cell of seed %lu, whose number it gets", u, at,
                 v);
        break;
    case MESHER_NOTE_UNSEEDED_CELL:
        snprintf(text, size, "a cell at %s has no seed and is left out, as others have one", a);
        break;
    case MESHER_NOTE_OUTSIDE_FACET:
        snprintf(text, size, "%s lies outside every cell, and is left out, %s", a, at);
        break;
    case MESHER_NOTE_CELLS_UNKNOWN:
        snprintf(text, size, "no mesh could be made, so it is not known whether triangles lie "
                             "outside every cell, or which cells are kept");
        break;
    default: break;
    }
}

/* What recovery could not do: bring in an edge or a facet, or take a point off the surface. */
static void mesher__recovery_sentence(char *text, size_t size, const mesher_finding *f,
                                      const char *a, const char *at)
{
    const unsigned long u = f->vertices[0], v = f->vertices[1], w = f->vertices[2];
    if (f->vertices[0] == DELAUNAY_NO_ID)
        snprintf(text, size, "a point would have to stay on %s, %s", a, at);
    else if (f->vertices[2] != DELAUNAY_NO_ID)
        snprintf(text, size, "facet %lu-%lu-%lu of %s could not be recovered, %s", u, v, w, a, at);
    else if (f->vertices[1] == DELAUNAY_NO_ID)
        snprintf(text, size, "a piece of an edge or facet of %s, by vertex %lu, could not be "
                 "recovered, %s", a, u, at);
    else snprintf(text, size, "edge %lu-%lu of %s could not be recovered, %s", u, v, a, at);
}

static void mesher__defect_sentence(char *text, size_t size, const mesher_report *report,
                                    const mesher_finding *f, const char *a, const char *b,
                                    const char *at)
{
    const unsigned long u = f->vertices[0], v = f->vertices[1], w = f->vertices[2];
    const int has_edge = f->vertices[1] != DELAUNAY_NO_ID && f->vertices[2] != DELAUNAY_NO_ID;
    const uint64_t open = report->counts[MESHER_NOTE_OPEN_EDGE];
    char others[40] = "";
    switch (f->kind) {
    case MESHER_DEFECT_NOT_FINITE:
        snprintf(text, size, "vertex %lu has a coordinate that is not a finite number", u);
        break;
    case MESHER_DEFECT_RANGE:
        if (f->vertices[0] == DELAUNAY_NO_ID)
            snprintf(text, size, "the whole surface is smaller than %g", MESHER__SMALLEST_EXTENT);
        else
            snprintf(text, size, "vertex %lu has a coordinate beyond %g", u,
                     MESHER__LARGEST_COORDINATE);
        break;
    case MESHER_DEFECT_INDEX:
        snprintf(text, size, "%s has vertex %lu, but there are only %lu", a, u,
                 (unsigned long)report->input_vertices);
        break;
    case MESHER_DEFECT_COLLINEAR:
        snprintf(text, size, "%s has its vertices %lu, %lu and %lu on one line, %s", a, u, v, w,
                 at);
        break;
    case MESHER_DEFECT_T_JUNCTION:
        if (has_edge)
            snprintf(text, size, "vertex %lu of %s lies on the edge %lu-%lu of %s, %s", u, a, v, w,
                     b, at);
        else snprintf(text, size, "vertex %lu of %s lies on %s, %s", u, a, b, at);
        break;
    case MESHER_DEFECT_OVERLAP:
        snprintf(text, size, "%s and %s lie in one plane and overlap, %s", a, b, at);
        break;
    case MESHER_DEFECT_INTERSECTION:
        snprintf(text, size, "%s and %s intersect, %s", a, b, at);
        break;
    case MESHER_DEFECT_FLAT:
        snprintf(text, size, "all vertices of the surface lie in one plane, %s", at);
        break;
    case MESHER_DEFECT_NO_CELL:
        if (open > 1) snprintf(others, sizeof others, " and %.0f others", (double)open - 1);
        if (a[0] && has_edge == 0 && f->vertices[0] != DELAUNAY_NO_ID)
            snprintf(text, size,
                     "the surface encloses no volume: it is open, at edge %lu-%lu of %s%s, %s", u,
                     v, a, others, at);
        else snprintf(text, size, "the surface encloses no volume");
        break;
    case MESHER_DEFECT_NONE_KEPT:
        snprintf(text, size, "none of the surface's cells is kept by the choice of regions");
        break;
    case MESHER_DEFECT_OUTSIDE_FACET:
        snprintf(text, size, "%s lies outside every cell, %s", a, at);
        break;
    case MESHER_DEFECT_RECOVERY: mesher__recovery_sentence(text, size, f, a, at); break;
    case MESHER_DEFECT_NOT_IN_MESH:
        if (w != DELAUNAY_NO_ID)
            snprintf(text, size, "facet %lu-%lu-%lu of %s is not in the mesh, %s", u, v, w, a, at);
        else snprintf(text, size, "edge %lu-%lu, %s, is not in the mesh, %s", u, v, a, at);
        break;
    default: break;
    }
}

/* One finding as a sentence. */
static void mesher__sentence(char *text, size_t size, const mesher_report *report,
                             const mesher_finding *f)
{
    char a[32], b[32], at[96];
    mesher__name(a, report, f->triangles[0]);
    mesher__name(b, report, f->triangles[1]);
    snprintf(at, sizeof at, "at (%.9g, %.9g, %.9g)", f->xyz[0], f->xyz[1], f->xyz[2]);
    if (mesher_is_defect(f->kind)) mesher__defect_sentence(text, size, report, f, a, b, at);
    else mesher__note_sentence(text, size, f, a, b, at);
}

/* Begins a stage, after which the report's message is about this call. Returns whether it is the
 * stage's turn; if not, the message says so. */
static int mesher__enter(mesher_report *report, int in_turn)
{
    if (report)
        snprintf(report->message, sizeof report->message, "%s",
                 in_turn ? "" : "this stage needs one before it, or has had its turn already");
    return in_turn;
}

/* Gives a failure that no finding explains the sentence of its result. */
static void mesher__message_failure(mesher_report *report, mesher_result result)
{
    if (result < 0 && !report->message[0])
        snprintf(report->message, sizeof report->message, "%s", mesher_result_string(result));
}

static void mesher__message_defect(mesher_report *report, const mesher_finding *finding)
{
    if (!report->message[0])
        mesher__sentence(report->message, sizeof report->message, report, finding);
}

/* "...; and 41 defects more" */
static void mesher__message_finish(mesher_report *report)
{
    uint64_t n = mesher__count_defects(report);
    size_t length = strlen(report->message);
    if (n > 1 && length < sizeof report->message - 48)
        snprintf(report->message + length, sizeof report->message - length,
                 "; and %s%lu defect%s more", mesher_counts_all(report) ? "" : "at least ",
                 (unsigned long)(n - 1), n > 2 ? "s" : "");
}

/* The first defects are kept, as many as there is room for, then notes in the room that is left. */
MESHER_API void mesher_report_add(mesher_report *report, mesher_kind kind, uint32_t triangle0,
                                  uint32_t triangle1, uint32_t vertex0, uint32_t vertex1,
                                  uint32_t vertex2, const double *xyz)
{
    mesher_finding f;
    uint64_t defects;
    if (!report || (int)kind < 0 || kind >= MESHER_NUM_KINDS) return;
    memset(&f, 0, sizeof f);
    f.kind = kind;
    f.triangles[0] = triangle0;
    f.triangles[1] = triangle1;
    f.vertices[0] = vertex0;
    f.vertices[1] = vertex1;
    f.vertices[2] = vertex2;
    if (xyz) memcpy(f.xyz, xyz, sizeof f.xyz);
    defects = mesher__count_defects(report);
    report->counts[kind]++;
    if (mesher_is_defect(kind)) {
        mesher__message_defect(report, &f);
        if (defects >= report->cap_findings) return;
        if (report->num_findings < report->cap_findings)
            report->findings[report->num_findings++] = report->findings[defects];
        report->findings[defects] = f;
    } else if (report->num_findings < report->cap_findings) {
        report->findings[report->num_findings++] = f;
    }
}

static void mesher__add_vertex_finding(mesher_report *report, mesher_kind kind,
                                       const mesher_surface *surface, uint32_t v, uint32_t other)
{
    mesher_report_add(report, kind, DELAUNAY_NO_ID, DELAUNAY_NO_ID, v, other, DELAUNAY_NO_ID,
                      mesher__point(surface, v));
}

/* The centroid of n of the vertices whose coordinates are in xyz. */
static void mesher__centroid_of(const double *xyz, const uint32_t *v, int n, double *out)
{
    int i, j;
    for (i = 0; i < 3; i++) {
        out[i] = 0;
        for (j = 0; j < n; j++) out[i] += xyz[3 * (size_t)v[j] + (size_t)i] / n;
    }
}

static void mesher__centroid(const mesher_surface *surface, const uint32_t *v, int n, double *xyz)
{
    mesher__centroid_of(surface->xyz, v, n, xyz);
}

static void mesher__add_edge_finding(mesher_report *report, mesher_kind kind,
                                     const mesher_surface *surface, uint32_t triangle0,
                                     uint32_t triangle1, const uint32_t *edge)
{
    double middle[3];
    mesher__centroid(surface, edge, 2, middle);
    mesher_report_add(report, kind, triangle0, triangle1, edge[0], edge[1], DELAUNAY_NO_ID, middle);
}

static void mesher__add_triangle_finding(mesher_report *report, mesher_kind kind,
                                         const mesher_surface *surface, uint32_t triangle0,
                                         uint32_t triangle1, const uint32_t *v)
{
    double middle[3];
    mesher__centroid(surface, v, 3, middle);
    mesher_report_add(report, kind, triangle0, triangle1, v[0], v[1], v[2], middle);
}

/* The vertices of an element: of triangle id or, from num_triangles on, of a line. Returns their
 * number. */
static int mesher__element(const mesher_surface *surface, uint32_t id, const uint32_t **v)
{
    if (id < surface->num_triangles) {
        *v = surface->triangles + 3 * (size_t)id;
        return 3;
    }
    *v = surface->edges + 2 * (id - surface->num_triangles);
    return 2;
}

/* The largest extent of the triangles and lines along an axis; unused vertices may be anywhere. lo:
 * the least coordinate on each axis; *largest: the largest absolute value of a coordinate. */
static double mesher__extent(const mesher_surface *surface, double *lo, double *largest)
{
    double hi[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL}, extent = 0;
    size_t elements = surface->num_triangles + surface->num_edges, i;
    int j, k, n;
    for (k = 0; k < 3; k++) lo[k] = HUGE_VAL;
    for (i = 0; i < elements; i++) {
        const uint32_t *v;
        n = mesher__element(surface, (uint32_t)i, &v);
        for (j = 0; j < n; j++)
            for (k = 0; k < 3; k++) {
                double x = mesher__point(surface, v[j])[k];
                lo[k] = x < lo[k] ? x : lo[k];
                hi[k] = x > hi[k] ? x : hi[k];
            }
    }
    *largest = 0;
    for (k = 0; k < 3; k++) {
        if (!elements) lo[k] = hi[k] = 0;
        if (hi[k] - lo[k] > extent) extent = hi[k] - lo[k];
        if (fabs(lo[k]) > *largest) *largest = fabs(lo[k]);
        if (fabs(hi[k]) > *largest) *largest = fabs(hi[k]);
    }
    return extent;
}

/* Finds the defects that make all further checks meaningless: indices, NaN, range. Returns their
 * number. */
static uint64_t mesher__check_numbers(const mesher_surface *surface, mesher_report *report)
{
    uint64_t before = mesher__count_defects(report);
    size_t elements = surface->num_triangles + surface->num_edges, i;
    int j, n;
    for (i = 0; i < elements; i++) {
        const uint32_t *v;
        n = mesher__element(surface, (uint32_t)i, &v);
        for (j = 0; j < n; j++)
            if (v[j] >= surface->num_vertices) {
                mesher_report_add(report, MESHER_DEFECT_INDEX, (uint32_t)i, DELAUNAY_NO_ID, v[j],
                                  DELAUNAY_NO_ID, DELAUNAY_NO_ID, NULL);
                break;
            }
    }
    for (i = 0; i < surface->num_vertices; i++) {
        const double *x = mesher__point(surface, (uint32_t)i);
        int finite = 1, distant = 0;
        for (j = 0; j < 3; j++) {
            if (!(fabs(x[j]) <= DBL_MAX)) finite = 0;
            else if (fabs(x[j]) > MESHER__LARGEST_COORDINATE) distant = 1;
        }
        if (!finite || distant)
            mesher__add_vertex_finding(report,
                                       finite ? MESHER_DEFECT_RANGE : MESHER_DEFECT_NOT_FINITE,
                                       surface, (uint32_t)i, DELAUNAY_NO_ID);
    }
    if (surface->num_vertices && mesher__count_defects(report) == before) {
        double lo[3], largest, extent = mesher__extent(surface, lo, &largest);
        if (extent > 0 && extent < MESHER__SMALLEST_EXTENT)
            mesher_report_add(report, MESHER_DEFECT_RANGE, DELAUNAY_NO_ID, DELAUNAY_NO_ID,
                              DELAUNAY_NO_ID, DELAUNAY_NO_ID, DELAUNAY_NO_ID,
                              mesher__point(surface, 0));
    }
    return mesher__count_defects(report) - before;
}

static uint64_t mesher__hash_point(const double *x)
{
    uint64_t h = 0, bits;
    int i;
    for (i = 0; i < 3; i++) {
        double c = x[i] + 0.0; /* -0.0 becomes 0.0 */
        memcpy(&bits, &c, sizeof bits);
        h = (h ^ bits) * UINT64_C(0x9E3779B97F4A7C15);
        h ^= h >> 29;
    }
    return h * UINT64_C(0xBF58476D1CE4E5B9);
}

/* Gives each vertex as survivor the first vertex with the same coordinates. */
static mesher_result mesher__weld(mesher_domain *domain)
{
    const mesher_surface *surface = &domain->surface;
    size_t n = surface->num_vertices, v;
    uint32_t *table;
    int bits = 4;
    while (((size_t)1 << bits) < 2 * n) bits++;
    table = (uint32_t *)delaunay_alloc(&domain->memory, (size_t)1 << bits, sizeof *table);
    if (!table) return MESHER_ERROR_OUT_OF_MEMORY;
    memset(table, 0xff, ((size_t)1 << bits) * sizeof *table);
    for (v = 0; v < n; v++) {
        const double *x = mesher__point(surface, (uint32_t)v), *y;
        size_t slot = (size_t)(mesher__hash_point(x) >> (64 - bits));
        domain->survivor[v] = (uint32_t)v;
        for (; table[slot] != DELAUNAY_NO_ID; slot = (slot + 1) & (((size_t)1 << bits) - 1)) {
            y = mesher__point(surface, table[slot]);
            if (x[0] == y[0] && x[1] == y[1] && x[2] == y[2]) {
                domain->survivor[v] = table[slot];
                break;
            }
        }
        if (table[slot] == DELAUNAY_NO_ID) table[slot] = (uint32_t)v;
    }
    delaunay_release(&domain->memory, table);
    return MESHER_OK;
}

/* Sorts three numbers; returns 1 if that is an odd permutation. */
static int mesher__ascend(uint32_t v[3])
{
    uint32_t s;
    int odd = 0;
    if (v[0] > v[1]) { s = v[0]; v[0] = v[1]; v[1] = s; odd ^= 1; }
    if (v[1] > v[2]) { s = v[1]; v[1] = v[2]; v[2] = s; odd ^= 1; }
    if (v[0] > v[1]) { s = v[0]; v[0] = v[1]; v[1] = s; odd ^= 1; }
    return odd;
}

/* Survivors of a triangle's vertices in ascending order; returns 1 if that is an odd
 * permutation. */
static int mesher__sorted_triangle(const mesher_domain *domain, size_t triangle, uint32_t v[3])
{
    const uint32_t *t = domain->surface.triangles + 3 * triangle;
    int i;
    for (i = 0; i < 3; i++) v[i] = domain->survivor[t[i]];
    return mesher__ascend(v);
}

static int mesher__collinear(const mesher_surface *surface, const uint32_t *v)
{
    return delaunay_collinear(mesher__point(surface, v[0]), mesher__point(surface, v[1]),
                              mesher__point(surface, v[2]));
}

/* Fills pairs[].value with the triangles whose three vertices are distinct and not collinear,
 * sorted by their ascending survivors, then by their own number; *count: how many. Reports the
 * others. */
static mesher_result mesher__order_triangles(mesher_domain *domain, hxtsort_pair *pairs,
                                             size_t *count, mesher_report *report)
{
    const mesher_surface *surface = &domain->surface;
    mesher_result result;
    size_t n = 0, i;
    uint32_t v[3];
    for (i = 0; i < surface->num_triangles; i++) {
        mesher__sorted_triangle(domain, i, v);
        if (v[0] == v[1] || v[1] == v[2]) {
            mesher_report_add(report, MESHER_NOTE_REPEATED_INDEX, (uint32_t)i, DELAUNAY_NO_ID, v[1],
                              DELAUNAY_NO_ID, DELAUNAY_NO_ID, mesher__point(surface, v[1]));
        } else if (mesher__collinear(surface, v)) {
            mesher__add_triangle_finding(report, MESHER_DEFECT_COLLINEAR, surface, (uint32_t)i,
                                         DELAUNAY_NO_ID, surface->triangles + 3 * i);
        } else {
            pairs[n].key = (uint64_t)v[1] << 32 | v[2];
            pairs[n++].value = i;
        }
    }
    *count = n;
    result = mesher__sort(domain, pairs, n);
    if (result != MESHER_OK) return result;
    for (i = 0; i < n; i++) {
        mesher__sorted_triangle(domain, (size_t)pairs[i].value, v);
        pairs[i].key = v[0];
    }
    return mesher__sort(domain, pairs, n);
}

/* Finds the facets; notes each triangle with the same vertices as an earlier one. */
static mesher_result mesher__find_facets(mesher_domain *domain, mesher_report *report)
{
    const mesher_surface *surface = &domain->surface;
    delaunay_memory *memory = &domain->memory;
    hxtsort_pair *pairs =
        (hxtsort_pair *)delaunay_alloc(memory, surface->num_triangles, sizeof *pairs);
    mesher_result result = MESHER_ERROR_OUT_OF_MEMORY;
    size_t n = 0, m = 0, i;
    uint32_t v[3];
    int odd = 0, first_odd = 0;
    if (!pairs) return result;
    result = mesher__order_triangles(domain, pairs, &n, report);
    if (result != MESHER_OK) goto done;
    result = MESHER_ERROR_OUT_OF_MEMORY;
    domain->facets = (uint32_t *)delaunay_alloc(memory, n, 3 * sizeof *domain->facets);
    domain->facet_source = (uint32_t *)delaunay_alloc(memory, n, sizeof *domain->facet_source);
    if (!domain->facets || !domain->facet_source) goto done;
    for (i = 0; i < n; i++) {
        odd = mesher__sorted_triangle(domain, (size_t)pairs[i].value, v);
        if (m && memcmp(v, domain->facets + 3 * (m - 1), sizeof v) == 0) {
            mesher__add_triangle_finding(
                report,
                odd == first_odd ? MESHER_NOTE_DUPLICATE_TRIANGLE : MESHER_NOTE_OPPOSITE_TRIANGLE,
                surface, domain->facet_source[m - 1], (uint32_t)pairs[i].value, v);
            continue;
        }
        memcpy(domain->facets + 3 * m, v, sizeof v);
        domain->facet_source[m++] = (uint32_t)pairs[i].value;
        first_odd = odd;
    }
    domain->num_facets = (uint32_t)m;
    result = MESHER_OK;
done:
    delaunay_release(memory, pairs);
    return result;
}

/* Lists the edges of the facets, and the lines, sorted by their vertices: key min<<32|max, value
 * source<<1|direction, where direction 1 means that the source triangle runs from max to min. */
static mesher_result mesher__order_edges(mesher_domain *domain, hxtsort_pair *pairs, size_t *count,
                                         mesher_report *report)
{
    const mesher_surface *surface = &domain->surface;
    size_t n = 0, i;
    int j;
    for (i = 0; i < domain->num_facets; i++) {
        const uint32_t *f = domain->facets + 3 * i;
        uint32_t v[3];
        uint64_t source = domain->facet_source[i];
        uint64_t odd = (uint64_t)mesher__sorted_triangle(domain, (size_t)source, v);
        for (j = 0; j < 3; j++) { /* an even permutation runs 0 1, 1 2, 2 0 */
            uint32_t a = f[j == 2 ? 0 : j], b = f[j == 2 ? 2 : j + 1];
            pairs[n].key = (uint64_t)a << 32 | b;
            pairs[n++].value = source << 1 | (odd ^ (uint64_t)(j == 2));
        }
    }
    for (i = 0; i < surface->num_edges; i++) {
        uint32_t a = domain->survivor[surface->edges[2 * i]],
                 b = domain->survivor[surface->edges[2 * i + 1]];
        uint32_t id = (uint32_t)(surface->num_triangles + i);
        if (a == b) {
            mesher_report_add(report, MESHER_NOTE_REPEATED_INDEX, id, DELAUNAY_NO_ID, a,
                              DELAUNAY_NO_ID, DELAUNAY_NO_ID, mesher__point(surface, a));
            continue;
        }
        pairs[n].key = mesher__pair(a, b);
        pairs[n++].value = (uint64_t)id << 1;
    }
    *count = n;
    return mesher__sort(domain, pairs, n);
}

/* Makes the notes on one edge, which is listed as pairs[0..n). Returns 1 if it is open. */
static int mesher__note_edge(const mesher_domain *domain, const hxtsort_pair *pairs, size_t n,
                              const uint32_t *edge, mesher_report *report)
{
    const mesher_surface *surface = &domain->surface;
    uint32_t source[2] = {DELAUNAY_NO_ID, DELAUNAY_NO_ID};
    size_t facets = 0, i;
    for (i = 0; i < n && pairs[i].value >> 1 < surface->num_triangles; i++, facets++)
        if (i < 2) source[i] = (uint32_t)(pairs[i].value >> 1);
    if (facets == 1)
        mesher__add_edge_finding(report, MESHER_NOTE_OPEN_EDGE, surface, source[0], DELAUNAY_NO_ID,
                                 edge);
    else if (facets > 2)
        mesher__add_edge_finding(report, MESHER_NOTE_NON_MANIFOLD_EDGE, surface, source[0],
                                 source[1], edge);
    else if (facets == 2 && ((pairs[0].value ^ pairs[1].value) & 1) == 0)
        mesher__add_edge_finding(report, MESHER_NOTE_FLIPPED_TRIANGLE, surface, source[0],
                                 source[1], edge);
    return facets == 1;
}

/* A hashed grid of points. Its cells are twice as wide as the distance that counts as near. */
typedef struct mesher__near_grid {
    const double *xyz;
    double        distance;
    uint32_t     *first; /* of each of the mask + 1 lists the first point, or NO_ID */
    uint32_t     *next;  /* of each point the next one in its list, or NO_ID */
    size_t        mask;
} mesher__near_grid;

static mesher_result mesher__near_init(mesher__near_grid *grid, delaunay_memory *memory,
                                       const double *xyz, size_t num_points, size_t num_used,
                                       double distance)
{
    grid->xyz = xyz;
    grid->distance = distance;
    for (grid->mask = 15; grid->mask < 2 * num_used; grid->mask = 2 * grid->mask + 1) {}
    grid->next = (uint32_t *)delaunay_alloc(memory, num_points, sizeof *grid->next);
    grid->first = (uint32_t *)delaunay_alloc(memory, grid->mask + 1, sizeof *grid->first);
    if (!grid->next || !grid->first) return MESHER_ERROR_OUT_OF_MEMORY;
    memset(grid->first, 0xff, (grid->mask + 1) * sizeof *grid->first);
    return MESHER_OK;
}

static void mesher__near_free(mesher__near_grid *grid, delaunay_memory *memory)
{
    delaunay_release(memory, grid->first);
    delaunay_release(memory, grid->next);
}

static int mesher__is_near(const double *x, const double *y, double distance)
{
    return fabs(x[0] - y[0]) <= distance && fabs(x[1] - y[1]) <= distance &&
           fabs(x[2] - y[2]) <= distance;
}

/* Returns the point with the smallest number in the grid that is near point v. If there is none,
 * adds v to the grid and returns NO_ID. Points near v lie in its cell or in the seven others around
 * the corner of this cell that is nearest to v. */
static uint32_t mesher__near_or_add(mesher__near_grid *grid, uint32_t v)
{
    const double *x = grid->xyz + 3 * (size_t)v;
    double cell[3], other[3], at[3];
    uint32_t best = DELAUNAY_NO_ID, u;
    size_t slot = 0;
    int d, k;
    for (k = 0; k < 3; k++) {
        double q = x[k] / grid->distance / 2;
        cell[k] = floor(q);
        other[k] = cell[k] + (q - cell[k] < 0.5 ? -1 : 1);
    }
    for (d = 7; d >= 0; d--) { /* its own cell last: v may be added there */
        for (k = 0; k < 3; k++) at[k] = d >> k & 1 ? other[k] : cell[k];
        slot = (size_t)mesher__hash_point(at) & grid->mask;
        for (u = grid->first[slot]; u != DELAUNAY_NO_ID; u = grid->next[u])
            if (u < best && mesher__is_near(x, grid->xyz + 3 * (size_t)u, grid->distance)) best = u;
    }
    if (best != DELAUNAY_NO_ID) return best;
    grid->next[v] = grid->first[slot];
    grid->first[slot] = v;
    return DELAUNAY_NO_ID;
}

/* Lists the ends of the open edges, each once, in ascending order. Returns their number. */
static size_t mesher__open_ends(const mesher_domain *domain, const uint32_t *open, size_t num,
                                uint8_t *seen, uint32_t *ends)
{
    size_t n = 0, i;
    memset(seen, 0, domain->first_corner);
    for (i = 0; i < 2 * num; i++) seen[domain->edges[2 * (size_t)open[i / 2] + i % 2]] = 1;
    for (i = 0; i < domain->first_corner; i++)
        if (seen[i]) ends[n++] = (uint32_t)i;
    return n;
}

/* Notes each end of an open edge that is nearly equal to one with a smaller number. */
static mesher_result mesher__note_near(mesher_domain *domain, const uint32_t *open, size_t num,
                                       mesher_report *report)
{
    const mesher_surface *surface = &domain->surface;
    delaunay_memory *memory = &domain->memory;
    mesher_result result = MESHER_ERROR_OUT_OF_MEMORY;
    mesher__near_grid grid;
    uint32_t *ends = NULL, best;
    uint8_t *seen = NULL;
    size_t n, i;
    double distance, lo[3], largest;
    memset(&grid, 0, sizeof grid);
    if (num == 0) return MESHER_OK;
    distance = MESHER_NEARLY * mesher__extent(surface, lo, &largest);
    seen = (uint8_t *)delaunay_alloc(memory, surface->num_vertices, 1);
    ends = (uint32_t *)delaunay_alloc(memory, 2 * num, sizeof *ends);
    if (!seen || !ends) goto done;
    n = mesher__open_ends(domain, open, num, seen, ends);
    result = mesher__near_init(&grid, memory, surface->xyz, surface->num_vertices, n, distance);
    for (i = 0; i < n && result == MESHER_OK; i++) {
        best = mesher__near_or_add(&grid, ends[i]);
        if (best != DELAUNAY_NO_ID)
            mesher__add_vertex_finding(report, MESHER_NOTE_NEAR_VERTEX, surface, ends[i], best);
    }
done:
    mesher__near_free(&grid, memory);
    delaunay_release(memory, ends);
    delaunay_release(memory, seen);
    return result;
}

/* Finds the distinct edges of facets and lines; notes those that are open, non-manifold or
 * inconsistently oriented. */
static mesher_result mesher__find_edges(mesher_domain *domain, mesher_report *report)
{
    delaunay_memory *memory = &domain->memory;
    size_t cap = 3 * (size_t)domain->num_facets + domain->surface.num_edges, n = 0, m = 0,
           num_open = 0, i, j, k;
    hxtsort_pair *pairs = (hxtsort_pair *)delaunay_alloc(memory, cap, sizeof *pairs);
    mesher_result result = MESHER_ERROR_OUT_OF_MEMORY;
    uint32_t *open = NULL;
    if (!pairs) return result;
    result = mesher__order_edges(domain, pairs, &n, report);
    if (result != MESHER_OK) goto done;
    for (i = 0; i < n; i++) m += i == 0 || pairs[i].key != pairs[i - 1].key;
    result = m >= UINT32_MAX ? MESHER_ERROR_TOO_LARGE : MESHER_ERROR_OUT_OF_MEMORY;
    if (result == MESHER_ERROR_TOO_LARGE) goto done;
    domain->edges = (uint32_t *)delaunay_alloc(memory, m, 2 * sizeof *domain->edges);
    domain->edge_source = (uint32_t *)delaunay_alloc(memory, m, sizeof *domain->edge_source);
    open = (uint32_t *)delaunay_alloc(memory, m, sizeof *open);
    if (!domain->edges || !domain->edge_source || !open) goto done;
    for (i = 0, m = 0; i < n; i = j, m++) {
        uint32_t *edge = domain->edges + 2 * m;
        uint64_t source = pairs[i].value >> 1;
        for (j = i + 1; j < n && pairs[j].key == pairs[i].key; j++) {}
        edge[0] = (uint32_t)(pairs[i].key >> 32);
        edge[1] = (uint32_t)pairs[i].key;
        for (k = i + 1; k < j; k++)
            if (pairs[k].value >> 1 < source) source = pairs[k].value >> 1;
        domain->edge_source[m] = (uint32_t)source;
        if (mesher__note_edge(domain, pairs + i, j - i, edge, report))
            open[num_open++] = (uint32_t)m;
    }
    domain->num_edges = (uint32_t)m;
    result = mesher__note_near(domain, open, num_open, report);
done:
    delaunay_release(memory, open);
    delaunay_release(memory, pairs);
    return result;
}

/* Index of the distinct edge a b, or NO_ID: the edges are sorted. */
static uint32_t mesher__edge_find(const mesher_domain *domain, uint32_t a, uint32_t b)
{
    uint64_t key = mesher__pair(a, b), k;
    uint32_t lo = 0, hi = domain->num_edges, mid;
    while (lo < hi) {
        mid = lo + (hi - lo) / 2;
        k = (uint64_t)domain->edges[2 * (size_t)mid] << 32 | domain->edges[2 * (size_t)mid + 1];
        if (k == key) return mid;
        if (k < key) lo = mid + 1;
        else hi = mid;
    }
    return DELAUNAY_NO_ID;
}

/* Takes facets with an open edge away, until none is left: such a facet has the same cell on both
 * sides, so no cell changes. *count: the facets that remain, *open_edge: the first open edge of the
 * whole surface, or NO_ID. */
static mesher_result mesher__peel(mesher_domain *domain, uint32_t *count, uint32_t *open_edge)
{
    delaunay_memory *memory = &domain->memory;
    uint32_t nf = domain->num_facets, ne = domain->num_edges, f, e, top = 0;
    uint32_t *facets_of = NULL, *sum = NULL, *edges_of = NULL, *stack = NULL;
    mesher_result result = MESHER_ERROR_OUT_OF_MEMORY;
    int j;
    *count = nf;
    *open_edge = DELAUNAY_NO_ID;
    facets_of = (uint32_t *)delaunay_alloc(memory, ne, sizeof *facets_of);
    sum = (uint32_t *)delaunay_alloc(memory, ne, sizeof *sum);
    edges_of = (uint32_t *)delaunay_alloc(memory, nf, 3 * sizeof *edges_of);
    stack = (uint32_t *)delaunay_alloc(memory, ne, sizeof *stack);
    if (!facets_of || !sum || !edges_of || !stack) goto done;
    memset(facets_of, 0, ne * sizeof *facets_of);
    memset(sum, 0, ne * sizeof *sum);
    for (f = 0; f < nf; f++)
        for (j = 0; j < 3; j++) {
            const uint32_t *v = domain->facets + 3 * (size_t)f;
            e = mesher__edge_find(domain, v[j], v[(j + 1) % 3]);
            edges_of[3 * (size_t)f + (size_t)j] = e;
            facets_of[e]++;
            sum[e] ^= f;
        }
    for (e = ne; e-- > 0;)
        if (facets_of[e] == 1) stack[top++] = *open_edge = e;
    while (top) {
        e = stack[--top];
        if (facets_of[e] != 1) continue;
        f = sum[e]; /* the only facet left there: in the exclusive or, those taken away cancel */
        --*count;
        for (j = 0; j < 3; j++) {
            e = edges_of[3 * (size_t)f + (size_t)j];
            sum[e] ^= f;
            if (--facets_of[e] == 1) stack[top++] = e;
        }
    }
    result = MESHER_OK;
done:
    delaunay_release(memory, stack);
    delaunay_release(memory, edges_of);
    delaunay_release(memory, sum);
    delaunay_release(memory, facets_of);
    return result;
}

/* Fills vertex_used: vertices of facets and lines, and isolated ones; notes duplicates. */
static void mesher__find_uses(mesher_domain *domain, mesher_report *report)
{
    const mesher_surface *surface = &domain->surface;
    size_t i;
    memset(domain->vertex_used, MESHER_VERTEX_ABSENT, surface->num_vertices);
    for (i = 0; i < 2 * (size_t)domain->num_edges; i++)
        domain->vertex_used[domain->edges[i]] = MESHER_VERTEX_SURFACE;
    for (i = 0; i < surface->num_vertices; i++) {
        uint32_t v = (uint32_t)i, s = domain->survivor[i];
        if (s != v) {
            mesher__add_vertex_finding(report, MESHER_NOTE_DUPLICATE_VERTEX, surface, v, s);
        } else if (domain->vertex_used[i] == MESHER_VERTEX_ABSENT) {
            domain->vertex_used[i] = MESHER_VERTEX_ISOLATED;
        }
    }
}

/* True if all facets lie in one plane. */
static int mesher__flat(const mesher_domain *domain)
{
    const mesher_surface *surface = &domain->surface;
    const uint32_t *f = domain->facets;
    size_t i;
    for (i = 3; i < 3 * (size_t)domain->num_facets; i++)
        if (delaunay_orient3d(mesher__point(surface, f[0]), mesher__point(surface, f[1]),
                              mesher__point(surface, f[2]), mesher__point(surface, f[i])))
            return 0;
    return 1;
}

/* Finds out, without a search in space, that a surface cannot enclose a volume: because it is flat,
 * or too open. */
static mesher_result mesher__check_cells(mesher_domain *domain, mesher_report *report)
{
    const mesher_surface *surface = &domain->surface;
    mesher_result result;
    uint32_t left = 0, e = 0;
    if (domain->num_facets && mesher__flat(domain)) {
        mesher__add_triangle_finding(report, MESHER_DEFECT_FLAT, surface, domain->facet_source[0],
                                     DELAUNAY_NO_ID, domain->facets);
        return MESHER_OK;
    }
    if (report->counts[MESHER_NOTE_OPEN_EDGE] == 0 && domain->num_facets) return MESHER_OK;
    result = mesher__peel(domain, &left, &e);
    if (result != MESHER_OK || left) return result;
    if (e != DELAUNAY_NO_ID)
        mesher__add_edge_finding(report, MESHER_DEFECT_NO_CELL, surface, domain->edge_source[e],
                                 DELAUNAY_NO_ID, domain->edges + 2 * (size_t)e);
    else
        mesher_report_add(report, MESHER_DEFECT_NO_CELL, DELAUNAY_NO_ID, DELAUNAY_NO_ID,
                          DELAUNAY_NO_ID, DELAUNAY_NO_ID, DELAUNAY_NO_ID, NULL);
    return MESHER_OK;
}

/* ---- >>check ------------------------------------------------------------------------------ */
/* The search for facets and lines (items) that meet where they must not. Items are sorted along the
 * Hilbert curve; above them is a complete binary tree of bounding boxes: leaf l holds items 4*l ..
 * 4*l+3, node k has children 2*k and 2*k+1. Boxes have float coordinates; the map from coordinates
 * to floats is monotone, so the boxes of items that meet overlap. */

enum {
    MESHER__LEAF_ITEMS = 4,
    MESHER__BLOCK_LEAVES = 32,    /* a task of one thread */
    /* Most blocks of a round. A round has twice as many as the one before, or half as many if that
     * had more than ROUND_FINDINGS. Between rounds the caller may cancel, and the number of
     * findings is compared with the limit below. */
    MESHER__ROUND_BLOCKS = 512,
    MESHER__ROUND_FINDINGS = 1 << 16,
    MESHER__BLOCK_FINDINGS = 32,  /* a block with more is searched a second time */
    MESHER__KEPT_FINDINGS = 1 << 20
};
typedef struct mesher__bounds {
    float lo[3], hi[3];
} mesher__bounds;

/* A facet (n = 3) or line (n = 2). */
typedef struct mesher__item {
    uint32_t v[3], n, id;
} mesher__item;

typedef struct mesher__space {
    const mesher_surface *surface;
    mesher__item *items;
    mesher__bounds  *boxes;   /* of items */
    mesher__bounds  *nodes;   /* 2*num_leaf_nodes; [0] unused */
    size_t        num_items, num_leaves, num_leaf_nodes;
    double        origin[3], scale;
} mesher__space;

static int mesher__boxes_meet(const mesher__bounds *a, const mesher__bounds *b)
{
    return a->lo[0] <= b->hi[0] && b->lo[0] <= a->hi[0] && a->lo[1] <= b->hi[1] &&
           b->lo[1] <= a->hi[1] && a->lo[2] <= b->hi[2] && b->lo[2] <= a->hi[2];
}

static void mesher__box_clear(mesher__bounds *box)
{
    int i;
    for (i = 0; i < 3; i++) {
        box->lo[i] = FLT_MAX;
        box->hi[i] = -FLT_MAX;
    }
}

static void mesher__box_join(mesher__bounds *a, const mesher__bounds *b)
{
    int i;
    for (i = 0; i < 3; i++) {
        if (b->lo[i] < a->lo[i]) a->lo[i] = b->lo[i];
        if (b->hi[i] > a->hi[i]) a->hi[i] = b->hi[i];
    }
}

/* A coordinate of a box; x <= y gives mesher__rounded(x) <= mesher__rounded(y). */
static float mesher__rounded(double x)
{
    return x > 1e30 ? 1e30f : x < -1e30 ? -1e30f : (float)x;
}

/* The box of n of the vertices whose coordinates are in xyz. */
static mesher__bounds mesher__box_around(const double *xyz, const uint32_t *v, uint32_t n,
                                         const double *origin, double scale)
{
    mesher__bounds box;
    uint32_t i;
    int j;
    mesher__box_clear(&box);
    for (i = 0; i < n; i++)
        for (j = 0; j < 3; j++) {
            float x = mesher__rounded((xyz[3 * (size_t)v[i] + (size_t)j] - origin[j]) * scale);
            if (x < box.lo[j]) box.lo[j] = x;
            if (x > box.hi[j]) box.hi[j] = x;
        }
    return box;
}

static mesher__bounds mesher__box_of(const mesher__space *space, const uint32_t *v, uint32_t n)
{
    return mesher__box_around(space->surface->xyz, v, n, space->origin, space->scale);
}

/* The number of leaves of a complete binary tree with room for so many items. */
static size_t mesher__leaf_nodes(size_t num_items)
{
    size_t leaves = (num_items + MESHER__LEAF_ITEMS - 1) / MESHER__LEAF_ITEMS, nodes = 1;
    while (nodes < leaves) nodes *= 2;
    return nodes;
}

/* Sets the boxes above those of the leaves. */
static void mesher__join_leaves(mesher__bounds *nodes, size_t num_leaf_nodes)
{
    size_t i;
    for (i = num_leaf_nodes; i-- > 1;) {
        nodes[i] = nodes[2 * i];
        mesher__box_join(nodes + i, nodes + 2 * i + 1);
    }
}

static void mesher__space_free(delaunay_memory *memory, mesher__space *space)
{
    delaunay_release(memory, space->items);
    delaunay_release(memory, space->boxes);
    delaunay_release(memory, space->nodes);
    memset(space, 0, sizeof *space);
}

static void mesher__gather_items(const mesher_domain *domain, mesher__item *items)
{
    size_t n = 0, i;
    for (i = 0; i < domain->num_facets; i++, n++) {
        memcpy(items[n].v, domain->facets + 3 * i, sizeof items[n].v);
        items[n].n = 3;
        items[n].id = domain->facet_source[i];
    }
    for (i = 0; i < domain->num_edges; i++) {
        if (domain->edge_source[i] < domain->surface.num_triangles) continue;
        items[n].v[0] = domain->edges[2 * i];
        items[n].v[1] = domain->edges[2 * i + 1];
        items[n].v[2] = DELAUNAY_NO_ID;
        items[n].n = 2;
        items[n++].id = domain->edge_source[i];
    }
}

static size_t mesher__count_items(const mesher_domain *domain)
{
    size_t n = domain->num_facets, i;
    for (i = 0; i < domain->num_edges; i++)
        n += domain->edge_source[i] >= domain->surface.num_triangles;
    return n;
}

/* Sets pairs to the order of n points along the Hilbert curve: value is the number of a point. */
static mesher_result mesher__order_points(delaunay_memory *memory, int num_threads,
                                          const double *xyz, size_t n, hxtsort_pair *pairs)
{
    mesher_result result = MESHER_ERROR_INTERNAL;
    uint64_t *keys = (uint64_t *)delaunay_alloc(memory, n, sizeof *keys);
    size_t i;
    if (!keys) return MESHER_ERROR_OUT_OF_MEMORY;
    if (hilbert_keys3(keys, xyz, 0, n, NULL, num_threads) == HILBERT_OK) {
        for (i = 0; i < n; i++) {
            pairs[i].key = keys[i];
            pairs[i].value = i;
        }
        result = mesher__sort_pairs(memory, num_threads, pairs, n);
    }
    delaunay_release(memory, keys);
    return result;
}

/* Sorts the items by the places of their centroids along the Hilbert curve. */
static mesher_result mesher__order_items(mesher_domain *domain, const mesher__item *items, size_t n,
                                         mesher__item *sorted)
{
    delaunay_memory *memory = &domain->memory;
    mesher_result result = MESHER_ERROR_OUT_OF_MEMORY;
    double *middles = (double *)delaunay_alloc(memory, n, 3 * sizeof *middles);
    hxtsort_pair *pairs = (hxtsort_pair *)delaunay_alloc(memory, n, sizeof *pairs);
    size_t i;
    if (middles && pairs) {
        for (i = 0; i < n; i++)
            mesher__centroid(&domain->surface, items[i].v, (int)items[i].n, middles + 3 * i);
        result = mesher__order_points(memory, domain->options.host.num_threads, middles, n, pairs);
    }
    for (i = 0; i < n && result == MESHER_OK; i++) sorted[i] = items[pairs[i].value];
    delaunay_release(memory, pairs);
    delaunay_release(memory, middles);
    return result;
}

static void mesher__build_tree(mesher__space *space)
{
    size_t i;
    for (i = 0; i < 2 * space->num_leaf_nodes; i++) mesher__box_clear(space->nodes + i);
    for (i = 0; i < space->num_items; i++) {
        space->boxes[i] = mesher__box_of(space, space->items[i].v, space->items[i].n);
        mesher__box_join(space->nodes + space->num_leaf_nodes + i / MESHER__LEAF_ITEMS,
                         space->boxes + i);
    }
    mesher__join_leaves(space->nodes, space->num_leaf_nodes);
}

static mesher_result mesher__space_init(mesher_domain *domain, mesher__space *space)
{
    delaunay_memory *memory = &domain->memory;
    mesher_result result = MESHER_ERROR_OUT_OF_MEMORY;
    size_t n = mesher__count_items(domain);
    double extent, largest;
    mesher__item *items = (mesher__item *)delaunay_alloc(memory, n, sizeof *items);
    memset(space, 0, sizeof *space);
    space->surface = &domain->surface;
    space->num_items = n;
    space->num_leaves = (n + MESHER__LEAF_ITEMS - 1) / MESHER__LEAF_ITEMS;
    space->num_leaf_nodes = mesher__leaf_nodes(n);
    space->items = (mesher__item *)delaunay_alloc(memory, n, sizeof *space->items);
    space->boxes = (mesher__bounds *)delaunay_alloc(memory, n, sizeof *space->boxes);
    space->nodes =
        (mesher__bounds *)delaunay_alloc(memory, 2 * space->num_leaf_nodes, sizeof *space->nodes);
    if (!items || !space->items || !space->boxes || !space->nodes) goto done;
    mesher__gather_items(domain, items);
    result = n ? mesher__order_items(domain, items, n, space->items) : MESHER_OK;
    if (result != MESHER_OK) goto done;
    extent = mesher__extent(&domain->surface, space->origin, &largest);
    space->scale = extent > 0 ? 1 / extent : 1;
    mesher__build_tree(space);
done:
    delaunay_release(memory, items);
    if (result != MESHER_OK) mesher__space_free(memory, space);
    return result;
}

/* -- Do two items meet, and where? All signs below are exact; only reported places are rounded. */

typedef struct mesher__hit {
    mesher_kind kind;
    int owner; /* T-junction: the vertex is one of the first (0) or second (1) of the pair */
    uint32_t    vertices[3];
    double      xyz[3];
} mesher__hit;

typedef struct mesher__simplex {
    const double *p[3];
    uint32_t      v[3];
} mesher__simplex;

static void mesher__simplex_set(mesher__simplex *shape, const mesher_surface *surface,
                                const uint32_t *v, uint32_t n)
{
    uint32_t i;
    for (i = 0; i < n; i++) {
        shape->v[i] = v[i];
        shape->p[i] = mesher__point(surface, v[i]);
    }
}

/* orient3d, after a quick test for what is frequent in CAD parts: four points in a plane x, y or z
 * = constant. */
static int mesher__orient(const double *a, const double *b, const double *c, const double *d)
{
    int i;
    for (i = 0; i < 3; i++)
        if (a[i] == b[i] && a[i] == c[i] && a[i] == d[i]) return 0;
    return delaunay_orient3d(a, b, c, d);
}

static int mesher__side(const mesher__simplex *t, const double *x)
{
    return mesher__orient(t->p[0], t->p[1], t->p[2], x);
}

/* A coordinate plane, named by the axis of its normal, in which the projection of the triangle is
 * not degenerate. */
static int mesher__plane_of(const mesher__simplex *t)
{
    int axis;
    for (axis = 0; axis < 2; axis++)
        if (delaunay_orient2d(t->p[0], t->p[1], t->p[2], axis) != 0) return axis;
    return 2;
}

/* Is x between p and q? The three points are collinear and distinct. */
static int mesher__between(const double *p, const double *q, const double *x)
{
    int i;
    for (i = 0; i < 3; i++)
        if (p[i] != q[i])
            return p[i] < q[i] ? p[i] < x[i] && x[i] < q[i] : q[i] < x[i] && x[i] < p[i];
    return 0;
}

/* Where in triangle t is x, which lies in its plane? 0: outside; 1: interior; 2: on the edge from
 * vertex *edge; 3: at a vertex. */
static int mesher__in_triangle(const mesher__simplex *t, const double *x, int axis, int *edge)
{
    int turn = delaunay_orient2d(t->p[0], t->p[1], t->p[2], axis), zeros = 0, i, o;
    for (i = 0; i < 3; i++) {
        o = turn * delaunay_orient2d(t->p[i], t->p[(i + 1) % 3], x, axis);
        if (o < 0) return 0;
        if (o == 0) {
            zeros++;
            *edge = i;
        }
    }
    return 1 + zeros;
}

/* Where a segment is 0, if these are its values at the ends, with different signs or rounded to 0:
 * from 0 to 1. */
static double mesher__zero(double hp, double hq)
{
    double sum = fabs(hp) + fabs(hq);
    return sum > 0 && sum <= DBL_MAX ? fabs(hp) / sum : 0.5;
}

/* The place of the hit is at part t of pq. */
static void mesher__hit_at(mesher__hit *hit, const double *p, const double *q, double t)
{
    int i;
    for (i = 0; i < 3; i++) hit->xyz[i] = p[i] + t * (q[i] - p[i]);
}

static int mesher__hit_cross(mesher__hit *hit, uint32_t v0, uint32_t v1)
{
    hit->kind = MESHER_DEFECT_INTERSECTION;
    hit->owner = 0;
    hit->vertices[0] = v0;
    hit->vertices[1] = v1;
    hit->vertices[2] = DELAUNAY_NO_ID;
    return 1;
}

/* Vertex v of one item lies on the edge v1 v2 of the other one or, if these are NO_ID, elsewhere on
 * its facet. */
static int mesher__hit_touch(mesher__hit *hit, int owner, uint32_t v, const double *x, uint32_t v1,
                             uint32_t v2)
{
    hit->kind = MESHER_DEFECT_T_JUNCTION;
    hit->owner = owner;
    hit->vertices[0] = v;
    hit->vertices[1] = v1;
    hit->vertices[2] = v2;
    memcpy(hit->xyz, x, sizeof hit->xyz);
    return 1;
}

/* Does vertex v of the first item, at x in the plane of t, lie on t? */
static int mesher__touch(const mesher__simplex *t, uint32_t v, const double *x, int axis,
                         mesher__hit *hit)
{
    int edge = 0, where = mesher__in_triangle(t, x, axis, &edge);
    if (where == 0) return 0;
    if (where == 2) return mesher__hit_touch(hit, 0, v, x, t->v[edge], t->v[(edge + 1) % 3]);
    return mesher__hit_touch(hit, 0, v, x, DELAUNAY_NO_ID, DELAUNAY_NO_ID);
}

/* Twice the area of abc projected onto a coordinate plane, rounded: for places only. */
static double mesher__area(const double *a, const double *b, const double *c, int axis)
{
    int i = (axis + 1) % 3, j = (axis + 2) % 3;
    return (b[i] - a[i]) * (c[j] - a[j]) - (b[j] - a[j]) * (c[i] - a[i]);
}

/* Do segments pq and rs, in one plane and without a common vertex, cross each other, or does an end
 * of rs lie within pq? */
static int mesher__segments_2d(const mesher__simplex *pq, const mesher__simplex *rs, int axis,
                               mesher__hit *hit)
{
    const double *p = pq->p[0], *q = pq->p[1], *r = rs->p[0], *s = rs->p[1];
    int or_ = delaunay_orient2d(p, q, r, axis), os = delaunay_orient2d(p, q, s, axis);
    if (or_ == 0 && mesher__between(p, q, r))
        return mesher__hit_touch(hit, 1, rs->v[0], r, pq->v[0], pq->v[1]);
    if (os == 0 && mesher__between(p, q, s))
        return mesher__hit_touch(hit, 1, rs->v[1], s, pq->v[0], pq->v[1]);
    if (or_ * os >= 0) return 0;
    if (delaunay_orient2d(r, s, p, axis) * delaunay_orient2d(r, s, q, axis) >= 0) return 0;
    mesher__hit_at(hit, p, q,
                   mesher__zero(mesher__area(r, s, p, axis), mesher__area(r, s, q, axis)));
    return mesher__hit_cross(hit, pq->v[0], pq->v[1]);
}

static void mesher__simplex_edge(mesher__simplex *edge, const mesher__simplex *t, int i)
{
    int j = (i + 1) % 3;
    edge->p[0] = t->p[i];
    edge->p[1] = t->p[j];
    edge->v[0] = t->v[i];
    edge->v[1] = t->v[j];
}

/* Does segment pq, in the plane of t and without a common vertex, meet t? If neither end is in t,
 * it has to cross an edge or pass through a vertex. */
static int mesher__segment_in_plane(const mesher__simplex *pq, const mesher__simplex *t,
                                    mesher__hit *hit)
{
    int axis = mesher__plane_of(t), i;
    mesher__simplex edge;
    for (i = 0; i < 2; i++)
        if (mesher__touch(t, pq->v[i], pq->p[i], axis, hit)) return 1;
    for (i = 0; i < 3; i++) {
        mesher__simplex_edge(&edge, t, i);
        if (mesher__segments_2d(pq, &edge, axis, hit)) return 1;
    }
    return 0;
}

/* Part x of segment pq, or the nearest one that is over or under t: where the segment is nearly in
 * the plane of t, rounding may make x any number. */
static double mesher__over(const mesher__simplex *pq, const mesher__simplex *t, int axis, double x)
{
    const double *p = pq->p[0], *q = pq->p[1];
    double turn = mesher__area(t->p[0], t->p[1], t->p[2], axis), low = 0, high = 1;
    int u = (axis + 1) % 3, v = (axis + 2) % 3, i;
    for (i = 0; i < 3; i++) {
        const double *a = t->p[i], *b = t->p[(i + 1) % 3];
        double hp = mesher__area(a, b, p, axis), hq = mesher__area(a, b, q, axis),
               zero = mesher__zero(hp, hq), wide = fabs(p[u] - a[u]);
        wide = fmax(fmax(wide, fabs(p[v] - a[v])), fmax(fabs(q[u] - a[u]), fabs(q[v] - a[v])));
        wide *= fabs(b[u] - a[u]) + fabs(b[v] - a[v]);
        if (fmax(fabs(hp), fabs(hq)) <= 1e-14 * wide) continue; /* perhaps rounding alone */
        if (turn < 0) hp = -hp, hq = -hq;
        /* by rounding both may be outside: then the end that is nearer */
        if (hp < 0 && hp < hq && zero > low) low = zero;
        if (hq < 0 && hq < hp && zero < high) high = zero;
    }
    return x < low ? low : x > high ? high : x;
}

/* Does segment pq, whose ends are strictly on different sides of the plane of t, meet t: in its
 * interior, on an edge, or at a vertex? */
static int mesher__segment_through(const mesher__simplex *pq, const mesher__simplex *t,
                                   mesher__hit *hit)
{
    const double *p = pq->p[0], *q = pq->p[1];
    int o[3], i, zeros = 0, plus = 0, minus = 0, axis = 0;
    double hp = 0, hq = 0, area, most = 0;
    for (i = 0; i < 3; i++) {
        o[i] = mesher__orient(p, q, t->p[i], t->p[(i + 1) % 3]);
        plus += o[i] > 0;
        minus += o[i] < 0;
        zeros += o[i] == 0;
    }
    if (plus && minus) return 0;
    for (i = 0; i < 3; i++) /* it meets two edges at once: at their common vertex */
        if (zeros == 2 && o[i] == 0 && o[(i + 2) % 3] == 0)
            return mesher__hit_touch(hit, 1, t->v[i], t->p[i], pq->v[0], pq->v[1]);
    for (i = 0; i < 3; i++) { /* heights over the plane of t */
        area = mesher__area(t->p[0], t->p[1], t->p[2], i);
        hp += (p[i] - t->p[0][i]) * area;
        hq += (q[i] - t->p[0][i]) * area;
        if (fabs(area) <= most) continue;
        most = fabs(area);
        axis = i;
    }
    mesher__hit_at(hit, p, q, mesher__over(pq, t, axis, mesher__zero(hp, hq)));
    return mesher__hit_cross(hit, pq->v[0], pq->v[1]);
}

/* Does a closed segment meet a closed triangle, without a common vertex? sp, sq: the sides of t on
 * which the ends are. */
static int mesher__segment_hits(const mesher__simplex *pq, int sp, int sq, const mesher__simplex *t,
                                mesher__hit *hit)
{
    if (sp * sq > 0) return 0;
    if (sp == 0 && sq == 0) return mesher__segment_in_plane(pq, t, hit);
    if (sp == 0) return mesher__touch(t, pq->v[0], pq->p[0], mesher__plane_of(t), hit);
    if (sq == 0) return mesher__touch(t, pq->v[1], pq->p[1], mesher__plane_of(t), hit);
    return mesher__segment_through(pq, t, hit);
}

/* Interiors of two triangles in one plane are disjoint if and only if a line along an edge
 * separates them. */
static int mesher__separated(const mesher__simplex *a, const mesher__simplex *b, int axis)
{
    int turn = delaunay_orient2d(a->p[0], a->p[1], a->p[2], axis), i, j;
    for (i = 0; i < 3; i++) {
        for (j = 0; j < 3; j++)
            if (turn * delaunay_orient2d(a->p[i], a->p[(i + 1) % 3], b->p[j], axis) > 0) break;
        if (j == 3) return 1;
    }
    return 0;
}

/* The mean of the corners of the polygon that a and b have in common, rounded. */
static void mesher__overlap_place(const mesher__simplex *a, const mesher__simplex *b, int axis,
                                  double *xyz)
{
    double polygon[8][3], next[8][3], side[8],
        turn = mesher__area(b->p[0], b->p[1], b->p[2], axis) < 0 ? -1 : 1;
    int n = 3, m, i, j, k;
    for (i = 0; i < 3; i++) memcpy(polygon[i], a->p[i], sizeof polygon[i]);
    for (k = 0; k < 3; k++) {
        for (i = 0; i < n; i++)
            side[i] = turn * mesher__area(b->p[k], b->p[(k + 1) % 3], polygon[i], axis);
        for (i = 0, m = 0; i < n && m < 7; i++) {
            int after = (i + 1) % n;
            if (side[i] >= 0) memcpy(next[m++], polygon[i], sizeof next[0]);
            if ((side[i] < 0) != (side[after] < 0)) {
                double t = side[i] / (side[i] - side[after]);
                for (j = 0; j < 3; j++)
                    next[m][j] = polygon[i][j] + t * (polygon[after][j] - polygon[i][j]);
                m++;
            }
        }
        if (m == 0) break; /* by rounding: the overlap is a sliver */
        n = m;
        memcpy(polygon, next, sizeof polygon);
    }
    for (j = 0; j < 3; j++)
        for (xyz[j] = 0, i = 0; i < n; i++) xyz[j] += polygon[i][j] / n;
}

static int mesher__hit_overlap(const mesher__simplex *a, const mesher__simplex *b, int axis,
                               mesher__hit *hit)
{
    hit->kind = MESHER_DEFECT_OVERLAP;
    hit->owner = 0;
    hit->vertices[0] = hit->vertices[1] = hit->vertices[2] = DELAUNAY_NO_ID;
    mesher__overlap_place(a, b, axis, hit->xyz);
    return 1;
}

static int mesher__has_vertex(const mesher__simplex *t, uint32_t v)
{
    return t->v[0] == v || t->v[1] == v || t->v[2] == v;
}

/* Do two triangles in one plane, with at most one common vertex, meet elsewhere? If their interiors
 * are disjoint, they can only touch in a segment or a point whose ends are vertices; one of these
 * that is not common lies on an edge of the other triangle. */
static int mesher__coplanar_hit(const mesher__simplex *a, const mesher__simplex *b,
                                mesher__hit *hit)
{
    int axis = mesher__plane_of(a), i;
    if (!mesher__separated(a, b, axis) && !mesher__separated(b, a, axis))
        return mesher__hit_overlap(a, b, axis, hit);
    for (i = 0; i < 3; i++)
        if (!mesher__has_vertex(b, a->v[i]) && mesher__touch(b, a->v[i], a->p[i], axis, hit))
            return 1;
    for (i = 0; i < 3; i++)
        if (!mesher__has_vertex(a, b->v[i]) && mesher__touch(a, b->v[i], b->p[i], axis, hit)) {
            hit->owner = 1;
            return 1;
        }
    return 0;
}

/* Two triangles with a common edge meet elsewhere only if they are folded onto each other. */
static int mesher__folded_hit(const mesher__simplex *a, const mesher__simplex *b, mesher__hit *hit)
{
    int i, j, k, axis;
    for (i = 0; i < 2 && mesher__has_vertex(b, a->v[i]); i++) {}
    for (j = 0; j < 2 && mesher__has_vertex(a, b->v[j]); j++) {}
    if (mesher__side(a, b->p[j]) != 0) return 0;
    axis = mesher__plane_of(a);
    k = (i + 1) % 3;
    if (delaunay_orient2d(a->p[k], a->p[(k + 1) % 3], a->p[i], axis) !=
        delaunay_orient2d(a->p[k], a->p[(k + 1) % 3], b->p[j], axis))
        return 0;
    return mesher__hit_overlap(a, b, axis, hit);
}

/* True if the bounding boxes of edge pq and of triangle t do not meet. */
static int mesher__edge_far(const double *p, const double *q, const mesher__simplex *t)
{
    int i;
    for (i = 0; i < 3; i++) {
        double a = t->p[0][i], b = t->p[1][i], c = t->p[2][i];
        double lo = a < b ? a : b, hi = a < b ? b : a;
        lo = c < lo ? c : lo;
        hi = c > hi ? c : hi;
        if ((p[i] < lo && q[i] < lo) || (p[i] > hi && q[i] > hi)) return 1;
    }
    return 0;
}

/* Two triangles with one common vertex, A = (v, a1, a2) and B = (v, b1, b2). If they are not in one
 * plane and share another point, the ray from v through it leaves one of them through its edge
 * opposite v, at a point of the other. So it is enough to test these two edges; for most pairs,
 * those in the fan of a vertex included, their boxes settle it. */
static int mesher__corner_hit(const mesher__simplex *a, const mesher__simplex *b, mesher__hit *hit)
{
    int sa[3], sb[3], i, j;
    mesher__simplex edge;
    for (i = 0; i < 2 && !mesher__has_vertex(b, a->v[i]); i++) {}
    for (j = 0; j < 2 && b->v[j] != a->v[i]; j++) {}
    if (mesher__edge_far(a->p[(i + 1) % 3], a->p[(i + 2) % 3], b) &&
        mesher__edge_far(b->p[(j + 1) % 3], b->p[(j + 2) % 3], a))
        return 0;
    sa[1] = mesher__side(b, a->p[(i + 1) % 3]);
    sa[2] = mesher__side(b, a->p[(i + 2) % 3]);
    if (sa[1] * sa[2] > 0) return 0;
    if (sa[1] == 0 && sa[2] == 0) return mesher__coplanar_hit(a, b, hit);
    sb[1] = mesher__side(a, b->p[(j + 1) % 3]);
    sb[2] = mesher__side(a, b->p[(j + 2) % 3]);
    if (sb[1] * sb[2] > 0) return 0;
    mesher__simplex_edge(&edge, a, (i + 1) % 3);
    if (mesher__segment_hits(&edge, sa[1], sa[2], b, hit)) return 1;
    mesher__simplex_edge(&edge, b, (j + 1) % 3);
    if (!mesher__segment_hits(&edge, sb[1], sb[2], a, hit)) return 0;
    hit->owner ^= 1;
    return 1;
}

/* Two triangles without a common vertex: if they meet, an edge of one meets the other. A crossing
 * is preferred to a vertex that touches. */
static int mesher__apart_hit(const mesher__simplex *a, const mesher__simplex *b, mesher__hit *hit)
{
    int s[2][3], i, k, found = 0;
    for (i = 0; i < 3; i++) s[0][i] = mesher__side(b, a->p[i]);
    if (s[0][0] == s[0][1] && s[0][0] == s[0][2])
        return s[0][0] == 0 ? mesher__coplanar_hit(a, b, hit) : 0;
    for (i = 0; i < 3; i++) s[1][i] = mesher__side(a, b->p[i]);
    if (s[1][0] == s[1][1] && s[1][0] == s[1][2]) return 0;
    for (k = 0; k < 2; k++)
        for (i = 0; i < 3; i++) {
            mesher__simplex edge;
            mesher__hit one;
            mesher__simplex_edge(&edge, k ? b : a, i);
            if (!mesher__segment_hits(&edge, s[k][i], s[k][(i + 1) % 3], k ? a : b, &one)) continue;
            one.owner ^= k;
            if (!found || one.kind == MESHER_DEFECT_INTERSECTION) *hit = one;
            found = 1;
            if (one.kind == MESHER_DEFECT_INTERSECTION) return 1;
        }
    return found;
}

/* Does a line meet a triangle other than in common vertices or a common edge? */
static int mesher__line_hit(const mesher__simplex *pq, const mesher__simplex *t, mesher__hit *hit)
{
    mesher__simplex edge, turned;
    int k, axis;
    if (mesher__has_vertex(t, pq->v[0]) && mesher__has_vertex(t, pq->v[1])) return 0;
    if (!mesher__has_vertex(t, pq->v[0]) && !mesher__has_vertex(t, pq->v[1]))
        return mesher__segment_hits(pq, mesher__side(t, pq->p[0]), mesher__side(t, pq->p[1]), t,
                                    hit);
    turned = *pq; /* common vertex first */
    if (!mesher__has_vertex(t, pq->v[0])) {
        turned.p[0] = pq->p[1]; turned.v[0] = pq->v[1];
        turned.p[1] = pq->p[0]; turned.v[1] = pq->v[0];
    }
    if (mesher__side(t, turned.p[1]) != 0) return 0;
    axis = mesher__plane_of(t);
    if (mesher__touch(t, turned.v[1], turned.p[1], axis, hit)) return 1;
    for (k = 0; t->v[k] != turned.v[0]; k++) {}
    mesher__simplex_edge(&edge, t, (k + 1) % 3);
    return mesher__segments_2d(&turned, &edge, axis, hit);
}

/* Do two lines meet other than in a common vertex? */
static int mesher__lines_hit(const mesher__simplex *a, const mesher__simplex *b, mesher__hit *hit)
{
    mesher__simplex t;
    int i, j;
    for (i = 0; i < 2; i++)
        for (j = 0; j < 2; j++)
            if (a->v[i] == b->v[j]) {
                const double *c = a->p[i], *p = a->p[1 - i], *q = b->p[1 - j];
                if (!delaunay_collinear(c, p, q)) return 0;
                if (mesher__between(c, p, q))
                    return mesher__hit_touch(hit, 1, b->v[1 - j], q, a->v[0], a->v[1]);
                if (mesher__between(c, q, p))
                    return mesher__hit_touch(hit, 0, a->v[1 - i], p, b->v[0], b->v[1]);
                return 0;
            }
    if (mesher__orient(a->p[0], a->p[1], b->p[0], b->p[1]) != 0) return 0;
    t.p[0] = a->p[0];
    t.p[1] = a->p[1];
    for (j = 0; j < 2; j++) {
        t.p[2] = b->p[j];
        if (!delaunay_collinear(t.p[0], t.p[1], t.p[2])) break;
    }
    if (j == 2) { /* all on one line */
        for (i = 0; i < 2; i++) {
            if (mesher__between(a->p[0], a->p[1], b->p[i]))
                return mesher__hit_touch(hit, 1, b->v[i], b->p[i], a->v[0], a->v[1]);
            if (mesher__between(b->p[0], b->p[1], a->p[i]))
                return mesher__hit_touch(hit, 0, a->v[i], a->p[i], b->v[0], b->v[1]);
        }
        return 0;
    }
    i = mesher__plane_of(&t);
    if (mesher__segments_2d(a, b, i, hit)) return 1;
    if (!mesher__segments_2d(b, a, i, hit)) return 0;
    hit->owner ^= 1;
    return 1;
}

/* Do two items of any kind meet where they must not? */
static int mesher__items_hit(const mesher__space *space, const mesher__item *a,
                             const mesher__item *b, mesher__hit *hit)
{
    mesher__simplex s, t;
    int shared = 0, i;
    mesher__simplex_set(&s, space->surface, a->v, a->n);
    mesher__simplex_set(&t, space->surface, b->v, b->n);
    if (a->n == 2 && b->n == 2) return mesher__lines_hit(&s, &t, hit);
    if (a->n == 2) return mesher__line_hit(&s, &t, hit);
    if (b->n == 2) {
        if (!mesher__line_hit(&t, &s, hit)) return 0;
        hit->owner ^= 1;
        return 1;
    }
    for (i = 0; i < 3; i++) shared += mesher__has_vertex(&t, s.v[i]);
    return shared == 0 ? mesher__apart_hit(&s, &t, hit)
         : shared == 1 ? mesher__corner_hit(&s, &t, hit) : mesher__folded_hit(&s, &t, hit);
}

/* -- The search for pairs. */

typedef struct mesher__sweep {
    const mesher__space *space;
    mesher_finding      *out;
    size_t               cap, count; /* room in out; findings, kept or not */
    uint64_t             kinds[MESHER_NUM_KINDS];
} mesher__sweep;

static void mesher__test_pair(mesher__sweep *sweep, size_t i, size_t j)
{
    const mesher__item *a = sweep->space->items + i, *b = sweep->space->items + j;
    mesher_finding *f;
    mesher__hit hit;
    int swap;
    if (a->id > b->id) {
        const mesher__item *c = a;
        a = b;
        b = c;
    }
    if (!mesher__items_hit(sweep->space, a, b, &hit)) return;
    sweep->kinds[hit.kind]++;
    if (sweep->count++ >= sweep->cap) return;
    f = sweep->out + sweep->count - 1;
    swap = hit.kind == MESHER_DEFECT_T_JUNCTION && hit.owner;
    f->kind = hit.kind;
    f->triangles[0] = swap ? b->id : a->id;
    f->triangles[1] = swap ? a->id : b->id;
    memcpy(f->vertices, hit.vertices, sizeof f->vertices);
    memcpy(f->xyz, hit.xyz, sizeof f->xyz);
}

static void mesher__test_leaves(mesher__sweep *sweep, size_t l, size_t m)
{
    const mesher__space *space = sweep->space;
    size_t n = space->num_items, end = (l + 1) * MESHER__LEAF_ITEMS,
           last = (m + 1) * MESHER__LEAF_ITEMS, i, j;
    for (i = l * MESHER__LEAF_ITEMS; i < end && i < n; i++) {
        if (!mesher__boxes_meet(space->boxes + i, space->nodes + space->num_leaf_nodes + m))
            continue;
        for (j = l == m ? i + 1 : m * MESHER__LEAF_ITEMS; j < last && j < n; j++)
            if (mesher__boxes_meet(space->boxes + i, space->boxes + j))
                mesher__test_pair(sweep, i, j);
    }
}

/* Tests leaf l against itself and all leaves after it: those under the right siblings of the leaf
 * and its ancestors. */
static void mesher__sweep_leaf(mesher__sweep *sweep, size_t l)
{
    const mesher__space *space = sweep->space;
    const mesher__bounds *box = space->nodes + space->num_leaf_nodes + l;
    size_t stack[66], k;
    int top = 0;
    mesher__test_leaves(sweep, l, l);
    for (k = space->num_leaf_nodes + l; k > 1; k /= 2) {
        if (k & 1) continue;
        stack[top++] = k + 1;
        while (top) {
            size_t node = stack[--top];
            if (!mesher__boxes_meet(box, space->nodes + node)) continue;
            if (node >= space->num_leaf_nodes) {
                mesher__test_leaves(sweep, l, node - space->num_leaf_nodes);
            } else {
                stack[top++] = 2 * node + 1;
                stack[top++] = 2 * node;
            }
        }
    }
}

/* Finds what the leaves of one block meet, in an order that depends on the block alone; the first
 * cap findings are written to out. */
static void mesher__sweep_block(mesher__sweep *sweep, const mesher__space *space, size_t block,
                                mesher_finding *out, size_t cap)
{
    size_t l = block * MESHER__BLOCK_LEAVES, end = l + MESHER__BLOCK_LEAVES;
    memset(sweep, 0, sizeof *sweep);
    sweep->space = space;
    sweep->out = out;
    sweep->cap = cap;
    for (; l < end && l < space->num_leaves; l++) mesher__sweep_leaf(sweep, l);
}

/* What the search has found so far. */
typedef struct mesher__found {
    mesher_finding *kept;
    size_t          num_kept, cap_kept;
    uint64_t        counts[MESHER_NUM_KINDS];
    uint64_t        total;
} mesher__found;

/* Counts all findings of a block, and keeps the first ones as far as there is room. */
static mesher_result mesher__found_add(delaunay_memory *memory, mesher__found *found,
                                       const mesher__sweep *sweep)
{
    size_t room = MESHER__KEPT_FINDINGS - found->num_kept,
           keep = sweep->count < room ? sweep->count : room, i;
    for (i = 0; i < MESHER_NUM_KINDS; i++) found->counts[i] += sweep->kinds[i];
    found->total += sweep->count;
    if (!mesher__room(memory, &found->kept, &found->cap_kept, found->num_kept,
                      found->num_kept + keep, sizeof *found->kept))
        return MESHER_ERROR_OUT_OF_MEMORY;
    if (keep) memcpy(found->kept + found->num_kept, sweep->out, keep * sizeof *sweep->out);
    found->num_kept += keep;
    return MESHER_OK;
}

/* Searches the blocks with more than BLOCK_FINDINGS findings again, now that their number is known,
 * for as many as can still be kept (room, of all blocks). The caller releases *out. */
static mesher_result mesher__sweep_again(mesher_domain *domain, const mesher__space *space,
                                         size_t first, size_t num, mesher__sweep *sweeps,
                                         size_t room, mesher_finding **out)
{
    size_t start[MESHER__ROUND_BLOCKS], keep[MESHER__ROUND_BLOCKS], more = 0, i;
    mesher_finding *large;
    long b, n = (long)num;
    int threads = num < 2 ? 1 : delaunay_threads(&domain->options.host);
    (void)threads;
    for (i = 0; i < num; i++) {
        keep[i] = sweeps[i].count < room ? sweeps[i].count : room;
        room -= keep[i];
        start[i] = more;
        if (keep[i] > MESHER__BLOCK_FINDINGS) more += keep[i];
    }
    *out = NULL;
    if (!more) return MESHER_OK;
    *out = large = (mesher_finding *)delaunay_alloc(&domain->memory, more, sizeof *large);
    if (!large) return MESHER_ERROR_OUT_OF_MEMORY;
    /* Shared: the boxes, read only; each block has its own part of the findings. */
    MESHER__OMP(omp parallel for schedule(dynamic, 1) num_threads(threads))
    for (b = 0; b < n; b++)
        if (keep[b] > MESHER__BLOCK_FINDINGS)
            mesher__sweep_block(sweeps + b, space, first + (size_t)b, large + start[b], keep[b]);
    return MESHER_OK;
}

/* One round: blocks [first, first+num). A thread writes only to the sweep of its block and to the
 * slice of BLOCK_FINDINGS findings that belongs to it. */
static mesher_result mesher__sweep_round(mesher_domain *domain, const mesher__space *space,
                                         size_t first, size_t num, mesher__sweep *sweeps,
                                         mesher_finding *slices, mesher__found *found)
{
    mesher_finding *large;
    mesher_result result;
    size_t i;
    long b, n = (long)num;
    int threads = num < 2 ? 1 : delaunay_threads(&domain->options.host);
    (void)threads;
    MESHER__OMP(omp parallel for schedule(dynamic, 1) num_threads(threads))
    for (b = 0; b < n; b++)
        mesher__sweep_block(sweeps + b, space, first + (size_t)b,
                            slices + (size_t)b * MESHER__BLOCK_FINDINGS, MESHER__BLOCK_FINDINGS);
    result = mesher__sweep_again(domain, space, first, num, sweeps,
                                 MESHER__KEPT_FINDINGS - found->num_kept, &large);
    for (i = 0; i < num && result == MESHER_OK; i++)
        result = mesher__found_add(&domain->memory, found, sweeps + i);
    delaunay_release(&domain->memory, large);
    return result;
}

static mesher_result mesher__sweep_all(mesher_domain *domain, const mesher__space *space,
                                       mesher__found *found)
{
    delaunay_memory *memory = &domain->memory;
    size_t blocks = (space->num_leaves + MESHER__BLOCK_LEAVES - 1) / MESHER__BLOCK_LEAVES;
    size_t most = blocks < (size_t)MESHER__ROUND_BLOCKS ? blocks : (size_t)MESHER__ROUND_BLOCKS,
           first, num, next = 1;
    mesher__sweep *sweeps = (mesher__sweep *)delaunay_alloc(memory, most, sizeof *sweeps);
    mesher_finding *slices = (mesher_finding *)delaunay_alloc(
        memory, most * MESHER__BLOCK_FINDINGS, sizeof *slices);
    mesher_result result = sweeps && slices ? MESHER_OK : MESHER_ERROR_OUT_OF_MEMORY;
    for (first = 0; first < blocks && result == MESHER_OK && found->total < MESHER_MOST_PAIRS;
         first += num) {
        uint64_t before = found->total;
        num = blocks - first < next ? blocks - first : next;
        if (mesher__progress(&domain->options, "intersections", (double)first / (double)blocks))
            result = MESHER_CANCELLED;
        else result = mesher__sweep_round(domain, space, first, num, sweeps, slices, found);
        if (found->total - before > MESHER__ROUND_FINDINGS) next = next > 1 ? next / 2 : 1;
        else next = 2 * next < most ? 2 * next : most;
    }
    delaunay_release(memory, sweeps);
    delaunay_release(memory, slices);
    return result;
}

static void mesher__add_finding(mesher_report *report, const mesher_finding *f)
{
    mesher_report_add(report, f->kind, f->triangles[0], f->triangles[1], f->vertices[0],
                      f->vertices[1], f->vertices[2], f->xyz);
}

/* Adds the findings to the report, in the order of their triangles. */
static mesher_result mesher__report_found(mesher_domain *domain, const mesher__found *found,
                                          mesher_report *report)
{
    hxtsort_pair *pairs =
        (hxtsort_pair *)delaunay_alloc(&domain->memory, found->num_kept, sizeof *pairs);
    uint64_t before[MESHER_NUM_KINDS];
    mesher_result result;
    size_t i;
    if (!pairs) return MESHER_ERROR_OUT_OF_MEMORY;
    for (i = 0; i < found->num_kept; i++) {
        pairs[i].key = (uint64_t)found->kept[i].triangles[0] << 32 | found->kept[i].triangles[1];
        pairs[i].value = i;
    }
    result = mesher__sort(domain, pairs, found->num_kept);
    memcpy(before, report->counts, sizeof before);
    for (i = 0; i < found->num_kept && result == MESHER_OK; i++)
        mesher__add_finding(report, found->kept + pairs[i].value);
    for (i = 0; i < MESHER_NUM_KINDS; i++) report->counts[i] = before[i] + found->counts[i];
    delaunay_release(&domain->memory, pairs);
    return result;
}

/* Reports every pair of facets and lines that meet where they must not. */
static mesher_result mesher__check_space(mesher_domain *domain, mesher_report *report)
{
    delaunay_memory *memory = &domain->memory;
    mesher__space space;
    mesher__found found;
    mesher_result result = mesher__space_init(domain, &space);
    if (result != MESHER_OK) return result;
    memset(&found, 0, sizeof found);
    result = mesher__sweep_all(domain, &space, &found);
    if (result == MESHER_OK) result = mesher__report_found(domain, &found, report);
    delaunay_release(memory, found.kept);
    mesher__space_free(memory, &space);
    if (result != MESHER_OK) return result;
    return mesher__count_defects(report) ? MESHER_ERROR_SURFACE : MESHER_OK;
}

/* True if the point lies on the item, exactly. */
static int mesher__point_on(const mesher__space *space, const mesher__item *item, const double *x)
{
    mesher__simplex t;
    int edge = 0;
    mesher__simplex_set(&t, space->surface, item->v, item->n);
    if (item->n == 2)
        return delaunay_collinear(t.p[0], t.p[1], x) && mesher__between(t.p[0], t.p[1], x);
    return mesher__side(&t, x) == 0 && mesher__in_triangle(&t, x, mesher__plane_of(&t), &edge) != 0;
}

/* The smallest id of the items that vertex v lies on, or NO_ID. */
static uint32_t mesher__item_under(const mesher__space *space, uint32_t v)
{
    const double *x = mesher__point(space->surface, v);
    mesher__bounds box = mesher__box_of(space, &v, 1);
    uint32_t best = DELAUNAY_NO_ID;
    size_t stack[66], i;
    int top = 0;
    stack[top++] = 1;
    while (top) {
        size_t node = stack[--top];
        if (!mesher__boxes_meet(&box, space->nodes + node)) continue;
        if (node < space->num_leaf_nodes) {
            stack[top++] = 2 * node + 1;
            stack[top++] = 2 * node;
            continue;
        }
        i = (node - space->num_leaf_nodes) * MESHER__LEAF_ITEMS;
        for (node = i + MESHER__LEAF_ITEMS; i < node && i < space->num_items; i++)
            if (space->items[i].id < best && mesher__boxes_meet(&box, space->boxes + i) &&
                mesher__point_on(space, space->items + i, x))
                best = space->items[i].id;
    }
    return best;
}

/* Whether v is in no facet or line, nor in a tetrahedron of the caller's (in_tets, or NULL). */
static int mesher__is_unused(const mesher_domain *domain, const uint8_t *in_tets, uint32_t v)
{
    return domain->vertex_used[v] == MESHER_VERTEX_ISOLATED && !(in_tets && in_tets[v]);
}

/* Decides which isolated vertices become points of the mesh: those that are wanted, but not one
 * that is exactly on a facet or line, which it would split. in_tets: nonzero for vertices of the
 * caller's tetrahedra, which are points of the mesh anyway; NULL: there are none. */
static mesher_result mesher__place_isolated(mesher_domain *domain, const uint8_t *in_tets,
                                            mesher_report *report)
{
    const mesher_surface *surface = &domain->surface;
    mesher__space space;
    mesher_result result;
    uint32_t v, n = domain->first_corner;
    int drop = domain->options.drop_unused;
    for (v = 0; v < n && !mesher__is_unused(domain, in_tets, v); v++) {}
    if (v == n) return MESHER_OK;
    memset(&space, 0, sizeof space);
    result = drop ? MESHER_OK : mesher__space_init(domain, &space);
    if (result != MESHER_OK) return result;
    for (; v < n; v++) {
        uint32_t under;
        if (!mesher__is_unused(domain, in_tets, v)) continue;
        if (surface->left_out && surface->left_out[v]) {
            domain->vertex_used[v] = MESHER_VERTEX_ABSENT;
            continue;
        }
        under = drop ? DELAUNAY_NO_ID : mesher__item_under(&space, v);
        if (drop || under != DELAUNAY_NO_ID) domain->vertex_used[v] = MESHER_VERTEX_ABSENT;
        mesher_report_add(report, MESHER_NOTE_UNUSED_VERTEX, under, DELAUNAY_NO_ID, v,
                          DELAUNAY_NO_ID, DELAUNAY_NO_ID, mesher__point(surface, v));
    }
    mesher__space_free(&domain->memory, &space);
    return MESHER_OK;
}

/* ---- >>empty ------------------------------------------------------------------------------ */

/* The result for one of delaunay.h. Failures that have no code here are due to the coordinates of
 * the surface. */
static mesher_result mesher__from_delaunay(delaunay_result result)
{
    return result >= DELAUNAY_ERROR_INTERNAL ? (mesher_result)result : MESHER_ERROR_SURFACE;
}

/* On every axis the box reaches this many times the points' largest extent beyond the points; then
 * it is rounded outwards to coordinates of few bits. It has to be this large: through the corners
 * of a large flat facet on the outside of the surface and a corner of the box goes a sphere that
 * bulges beyond the facet, the less the farther the corner is. Points in the bulge have edges to
 * that corner, through the facet; where a dense part of the surface lies closely behind a large
 * flat one, they are thousands, which are hard to flip away. (The order of insertion does not
 * suffer: points that share a cell of the curve are sorted in a bounding box of their own.) */
#  define MESHER__BOX_EXTENTS 1024

static void mesher__box(const mesher_domain *domain, double *lo, double *hi)
{
    const double *x = domain->surface.xyz;
    double extent = 0, distant = 0, unit;
    size_t i;
    int k, e, first = 1;
    for (k = 0; k < 3; k++) lo[k] = hi[k] = 0;
    for (i = 0; i < domain->surface.num_vertices; i++) {
        if (domain->vertex_used[i] == MESHER_VERTEX_ABSENT) continue;
        for (k = 0; k < 3; k++) {
            if (first || x[3 * i + (size_t)k] < lo[k]) lo[k] = x[3 * i + (size_t)k];
            if (first || x[3 * i + (size_t)k] > hi[k]) hi[k] = x[3 * i + (size_t)k];
        }
        first = 0;
    }
    for (k = 0; k < 3; k++) {
        if (hi[k] - lo[k] > extent) extent = hi[k] - lo[k];
        if (fabs(lo[k]) > distant) distant = fabs(lo[k]);
        if (fabs(hi[k]) > distant) distant = fabs(hi[k]);
    }
    if (!(extent > 0)) extent = distant > 0 ? distant : 1;
    frexp(extent, &e);
    unit = ldexp(1.0, e - 4);
    frexp(distant, &e);
    if (distant > 0 && unit < ldexp(1.0, e - 46)) unit = ldexp(1.0, e - 46);
    for (k = 0; k < 3; k++) {
        lo[k] = (floor((lo[k] - MESHER__BOX_EXTENTS * extent) / unit) - 1) * unit;
        hi[k] = (ceil((hi[k] + MESHER__BOX_EXTENTS * extent) / unit) + 1) * unit;
    }
}

/* True if the mesh has no vertex at the place of input vertex v. */
static int mesher__is_absent(const mesher_domain *domain, size_t v)
{
    return domain->vertex_used[domain->survivor[v]] == MESHER_VERTEX_ABSENT;
}

/* The points to triangulate: the input vertices, but absent ones at the place of box corner 0, as
 * its duplicates; then the 8 corners of the box. */
static void mesher__points(const mesher_domain *domain, double *xyz)
{
    size_t n = domain->surface.num_vertices, i, k;
    double box[2][3];
    mesher__box(domain, box[0], box[1]);
    if (n) memcpy(xyz, domain->surface.xyz, 3 * n * sizeof *xyz);
    for (i = 0; i < 8; i++)
        for (k = 0; k < 3; k++) xyz[3 * (n + i) + k] = box[i >> k & 1][k];
    for (i = 0; i < n; i++)
        if (mesher__is_absent(domain, i)) memcpy(xyz + 3 * i, xyz + 3 * n, 3 * sizeof *xyz);
}

/* Fills vertex_id and corrects vertex_of: a vertex has the id of its point that is not absent;
 * absent points have vertex 0, unless they are duplicates of one that is not. */
static void mesher__name_vertices(mesher_domain *domain)
{
    delaunay_mesh *mesh = &domain->mesh;
    uint32_t n = (uint32_t)domain->surface.num_vertices, i;
    for (i = 0; i < n + 8; i++)
        if (i >= n || domain->vertex_used[i] != MESHER_VERTEX_ABSENT)
            mesh->vertex_id[mesh->vertex_of[i]] = i;
        else if (mesher__is_absent(domain, i)) mesh->vertex_of[i] = 0;
}

MESHER_API mesher_result mesher_empty_mesh(mesher_domain *domain, mesher_report *report)
{
    size_t n;
    double *xyz, start;
    delaunay_options options;
    delaunay_report inner;
    delaunay_result result;
    if (!mesher__enter(report, domain && domain->stage == MESHER__STAGE_INIT))
        return MESHER_ERROR_INVALID_ARGUMENT;
    domain->stage = MESHER__STAGE_FAILED;
    start = delaunay_seconds(&domain->options.host);
    n = domain->surface.num_vertices;
    xyz = (double *)delaunay_alloc(&domain->memory, 3 * (n + 8), sizeof *xyz);
    if (!xyz) return MESHER_ERROR_OUT_OF_MEMORY;
    memset(&options, 0, sizeof options);
    options.host = domain->options.host;
    mesher__points(domain, xyz);
    result = delaunay_tetrahedralize(&domain->mesh, xyz, n + 8, &options, &inner);
    delaunay_release(&domain->memory, xyz);
    domain->first_corner = (uint32_t)n;
    if (result == DELAUNAY_OK) result = delaunay_enable_marks(&domain->mesh);
    if (result == DELAUNAY_OK) result = delaunay_link_vertices(&domain->mesh);
    if (result == DELAUNAY_OK) mesher__name_vertices(domain);
    if (report) report->seconds_empty = delaunay_seconds(&domain->options.host) - start;
    if (result == DELAUNAY_OK) {
        domain->stage = MESHER__STAGE_EMPTY;
        return MESHER_OK;
    }
    if (report)
        snprintf(report->message, sizeof report->message, "empty mesh: %.400s",
                 inner.message[0] ? inner.message : delaunay_result_string(result));
    delaunay_mesh_free(&domain->mesh);
    return mesher__from_delaunay(result);
}

/* ---- >>recover ----------------------------------------------------------------------------
 * Almost all edges and facets of the surface are in the Delaunay triangulation already; what is
 * missing is mostly edges that cross one or two faces of the mesh. "The pipe" of a missing edge or
 * facet is all that it crosses.
 *   1. Flips bring in the missing edges one by one, in a copy of the tetrahedra around each, to
 *      growing depth; all threads try many edges at once. Where flat sides of the surface consist
 *      of needles, flips within their planes come first, with Steiner points beside the planes.
 *      Where many edges are still missing then, flips go from their ends inwards, much deeper.
 *   2. Closure searches (delaunay_reconnect) follow for the few edges that are left, over windows:
 *      small sets of tetrahedra around the faces that an edge crosses. (When the attempts that
 *      start with flips have failed, in several orders, later ones use searches for all edges.) A
 *      search that lowers the number of crossings is committed; it never loses a constrained edge
 *      that the mesh has. The steps for one edge are a transaction: they stay if the edge comes in,
 *      or if the potential (missing edges, crossings of all missing edges) falls; else they are
 *      taken back. So the potential falls strictly, and the loop terminates.
 *   3. Missing facets whose three edges are in the mesh come in by the same searches, which now
 *      minimise the number of edges that pierce the facet, and keep all facets that the mesh has.
 *   4. What is left, such as a Schonhardt polyhedron, gets interior Steiner points: each in the
 *      kernel of a window, where it removes the most crossings.
 *   5. At last, points on the missing edges and facets let these come in as pieces; then the points
 *      are taken off the surface again.
 *   6. Interior Steiner points are removed where they can be moved onto a neighbour, or where a
 *      search finds a filling of their star without them.
 * After the triangulation every decision is an exact orientation of stored coordinates. A missing
 * edge that meets a constrained facet or edge of the mesh proves that the surface intersects
 * itself. */
enum {
    MESHER__PIPE = 2048,         /* crossings or tetrahedra of one pipe at most */
    MESHER__LONG_PIPE = 32,      /* attempts by flips: an edge with more crossings than this gets
                                    only points on it, no searches and (but at the end of the last
                                    of these attempts) no interior points */
    MESHER__MAX_WINDOWS = 4000,  /* around one edge or facet */
    /* Pieces of split edges, and of split facets, at most: so many for each missing edge, a power
     * of two between these two. */
    MESHER__PIECES_EACH = 256, MESHER__FEW_PIECES = 16384, MESHER__MOST_PIECES = 262144,
    MESHER__SHELL = 2048,        /* facets of a shell, and tetrahedra around a point that is taken
                                    off the surface at most */
    MESHER__SECTOR_GROWTH = 300, /* tetrahedra outside a star that its sector takes in at most */
    MESHER__FEW_EDGES = 32,  /* up to this many missing edges get large searches before any point is
                                added (of more of them, one in hundreds comes in that way), and more
                                rounds of points before the surface is tested for intersections */
    MESHER__MANY_EDGES = 256, /* more missing edges than this after the first flips, of which valid
                                 surfaces seldom leave more, are cause to test at once */
    MESHER__FEW_FACETS = 64, /* up to this many missing facets get points before that test */
    /* Attempts at the whole recovery, with points at other places each time; the first of them are
     * "by flips": they try flips before anything else, each in another order. */
    MESHER__ATTEMPTS = 6, MESHER__FLIP_ATTEMPTS = 3,
    MESHER__FEW_SPLITS = 1000, /* missing edges at the end of an attempt by flips up to which it
                                  puts points on them, the last one first interior points */
    MESHER__LAST_EDGES = 8,    /* edges still missing after that up to which these get interior
                                  points */
    MESHER__FEW_POINTS = 4,    /* interior points for one edge in an attempt by flips at most */
    /* Rounds of points on edges end when the number of missing edges has stayed the same, or has
     * risen, for this many rounds (see mesher__course_fails). */
    MESHER__SPLIT_STAYS = 6, MESHER__SPLIT_RISES = 3,
    MESHER__VAIN = 8,        /* an attempt by flips adds no interior points any more after this many
                                that brought nothing, plus one for each 8 missing edges */
    /* Windows that are looked at for one point: at least, even if one is good enough (in attempts
     * by flips, and in later ones), and at most (the same). */
    MESHER__FEW_SITES = 6, MESHER__MANY_SITES = 40,
    MESHER__SITES_FIRST = 24, MESHER__SITES = 250,
    MESHER__HOPELESS = 4,    /* interior points that brought nothing before an edge gets no more */
    MESHER__GRID_CELLS = 64, /* cells that one box may cover; for a larger one all missing edges are
                                looked at */
    MESHER__NEAR = 4096      /* missing edges beside one window at most */
};
#  define MESHER__ABSENT UINT32_MAX /* no such edge, facet or place */
/* The least distance of a point on a missing edge from the edge's ends, in lengths of the edge. The
 * rounding of a nearer point may carry it across pieces of the surface that end there. */
#  define MESHER__SPLIT_MARGIN 1e-5
#  if defined(__GNUC__)
#    define MESHER__PREFETCH(p) __builtin_prefetch(p)
#  else
#    define MESHER__PREFETCH(p) ((void)(p))
#  endif

/* A hash set of 64-bit keys; incrementing its epoch empties it. */
typedef struct mesher__set {
    uint64_t        *keys;
    uint32_t        *stamps;
    size_t           cap, count; /* cap: a power of two */
    uint32_t         epoch;
    delaunay_memory *memory;
} mesher__set;

/* A Steiner point on an edge or facet of the surface, to be taken off it again. */
typedef struct mesher__split {
    uint32_t vertex, edge;          /* edge is MESHER__ABSENT if a facet is split */
    uint32_t num_facets;            /* those at a split edge, which are split with it; or the one */
    uint32_t facets[32];
    uint32_t first_edge, first_facet, end_edge, end_facet; /* the ranges of the pieces */
    int      undone;                /* the point is off the surface */
} mesher__split;
/* In edge_origin: the edge is within a facet, whose index the other bits are. */
#define MESHER__IN_FACET 0x80000000u

/* Where a missing edge crosses a face of the mesh. */
typedef struct mesher__crossing {
    delaunay_handle tets[2];
    int             facet; /* the face, as a facet of tets[0] */
    double          where; /* along the edge, about: 0 and 1 at its ends */
} mesher__crossing;

/* What is in the way of a missing edge or facet. */
typedef struct mesher__pipe {
    mesher__crossing crossings[MESHER__PIPE];    /* for an edge: in order along it */
    uint32_t         edges[MESHER__PIPE][2];     /* for a facet: edges of the mesh that pierce it */
    delaunay_handle  edge_tets[MESHER__PIPE];    /* a tetrahedron of each of these edges */
    delaunay_handle  tets[MESHER__PIPE];         /* tetrahedra with such a face or edge */
    uint32_t num_crossings, num_edges, num_tets;
    int      too_long;                           /* for an edge: it did not fit */
    uint32_t vertex;                             /* one exactly on the edge or facet; 0: none */
    int blocked; /* by a constraint of the mesh: its number of vertices, 2 or 3; 0: by none */
    uint32_t blocker[3];
} mesher__pipe;

/* Limits of flips in a plane. */
enum {
    MESHER__SPIN = 128,    /* tetrahedra around a rung at most */
    MESHER__HALF = 24,     /* vertices of a half at most, to fill it without a Steiner point */
    MESHER__CAVE = 1000,   /* tetrahedra that make room for a point beside a plane at most */
    MESHER__MANY_RUNGS = 24,  /* of a missing edge on average, for flips in planes to be used at
                                 once: where there are few, other steps need fewer points */
    MESHER__RUNG_SAMPLE = 256, /* missing edges, about, from which this is estimated first */
    MESHER__FACETS_IN_PLANES = 1024 /* at most, for each edge that this can bring in */
};

/* A rung: an edge of the mesh that crosses a missing edge within a plane that both lie in. */
typedef struct mesher__rung {
    uint32_t        p, q;  /* its ends, to the left and right of the missing edge */
    delaunay_handle t;     /* a tetrahedron that has both, or had */
    int             stuck; /* cannot be flipped without a Steiner point, as the mesh is now */
} mesher__rung;

/* The ring of an edge pq, or the half of it on one side of a plane: tetrahedron i has p, q, v[i],
 * v[i + 1], positive in this order. */
typedef struct mesher__spin {
    uint32_t        n, v[MESHER__SPIN];
    delaunay_handle tets[MESHER__SPIN];
} mesher__spin;

typedef struct mesher__plane {
    mesher__rung rungs[MESHER__PIPE + 1];  /* in order along the missing edge */
    uint32_t     count, off;               /* off: a vertex that is not in the plane */
    double       tolerance;                /* vertices this near to a plane count as in it */
    double       at[3], normal[3], wide;   /* the plane; wide: see mesher__plane_through */
    mesher__spin spin;
    uint8_t      apex[MESHER__HALF][MESHER__HALF], cost[MESHER__HALF][MESHER__HALF];
} mesher__plane;

/* A window: some tetrahedra around what is missing, listed in r->pool from place first on. */
typedef struct mesher__window {
    uint64_t signature;
    uint32_t first, num_tets, num_points;
} mesher__window;

/* Limits of flips in a copy of a few tetrahedra. */
enum {
    MESHER__CELLS = 1024,      /* tetrahedra copied, and made by flips */
    MESHER__CELL_BITS = 10,    /* of a cell's number */
    MESHER__CELL_SLOTS = 4096, /* a power of two */
    MESHER__RING = 20,         /* tetrahedra around an edge at most */
    MESHER__RING_FILLED = 16,  /* the same for an edge to be removed from an end of the way */
    MESHER__RING_USUAL = 7,    /* the same elsewhere: of longer rings one in fifty can be filled, at
                                  a high cost */
    MESHER__WAY = 64,          /* faces and edges that the missing edge crosses at most, or that are
                                  looked at from one of its ends */
    MESHER__FLIP_LOG = 8192,
    MESHER__VIEWS = 128,       /* a power of two */
    MESHER__RINGS = 64,        /* the same */
    MESHER__FLIP_DEPTH = 16,
    /* Flips from the ends of missing edges: how deep removals nest, edges that may be tried for one
     * obstacle, passes without success after which they end, and the length of the log at which
     * they are committed. */
    MESHER__END_DEPTH = 100,
    MESHER__END_BUDGET = 1024,
    MESHER__END_VAIN = 4,
    MESHER__END_LOG = 400,
    /* For a point that is to be removed: tetrahedra around it at most, edges at it that may be
     * tried, and how deep removals of edges nest. */
    MESHER__THIN_STAR = 200,
    MESHER__THIN_BUDGET = 1000,
    MESHER__THIN_DEPTH = 3,
    MESHER__FLIP_PASSES = 16,
    /* A pass is followed by another one if it brought in at least one in 32 of the missing edges,
     * or one in 8 where refinement follows, which adds points anyway. */
    MESHER__FLIP_YIELD = 32,
    MESHER__QUICK_YIELD = 8,
    /* Room in mesher__flipped: tetrahedra removed, and tetrahedra made; missing edges made; and
     * tetrahedra that a result depends on, if it is found ahead of time. */
    MESHER__FLIPPED = 256,
    MESHER__FLIPPED_EDGES = 64,
    MESHER__FLIPPED_READ = 512,
    /* A long list of missing edges is cut into strands: runs of about 64 edges, but at least 8 and
     * at most 128 strands. A batch that is tried at once has one edge of each strand, and so no
     * neighbours in the list, which are mostly near each other in space. */
    MESHER__STRAND = 64,
    MESHER__FEW_STRANDS = 8,
    MESHER__STRANDS = 128
};

/* A cell: a tetrahedron of the copy, positively oriented. */
typedef struct mesher__copy {
    uint32_t        v[4];
    /* what is beyond facet k: 4 * cell + facet, if bit k of linked is set; else as in the mesh */
    delaunay_handle n[4];
    delaunay_handle from; /* the original in the mesh; 0: made by a flip */
    uint16_t        flags;
    uint8_t         linked, gone;
    uint8_t         rings; /* of edges that wait to be removed; those that it is in */
} mesher__copy;

/* A face (facet k of a cell, 0 <= k < 4) or an edge (k < 0) that the missing edge crosses. */
typedef struct mesher__obstacle {
    uint32_t cell, v[3];
    int      k;
    /* of a face: the i of its edges v[i] v[i + 1], the nearest to the missing edge first; order[0]
     * is MESHER__UNORDERED before they are sorted */
    uint8_t order[3];
} mesher__obstacle;
#  define MESHER__UNORDERED 3

/* All that the missing edge crosses, in order from its first end on. */
typedef struct mesher__way {
    mesher__obstacle at[MESHER__WAY];
    uint32_t         count;
    int              cut; /* there are more */
} mesher__way;

/* The ring of an edge pq: cell i has p, q, r[i], r[i + 1], positive in this order. */
typedef struct mesher__ring {
    uint32_t p, q, n, r[MESHER__RING], cells[MESHER__RING];
} mesher__ring;

/* The triangulation that was found for a ring: apex[i][j] is the third vertex of the triangle at
 * chord ij, i < j. */
typedef struct mesher__ring_filled {
    uint32_t epoch, p, q, ear, n, r[MESHER__RING_FILLED];
    int      filled; /* 0: there is none */
    uint8_t  apex[MESHER__RING_FILLED][MESHER__RING_FILLED];
} mesher__ring_filled;

/* The view of a vertex: its projection along the missing edge, approximate, in units of the edge's
 * length. */
typedef struct mesher__view {
    uint64_t key; /* epoch and vertex */
    double   x, y, distant; /* distant: an upper bound of the vertex's distance from point a */
} mesher__view;

typedef struct mesher__flips {
    const delaunay_mesh *mesh;
    uint32_t     a, b;   /* the missing edge */
    double       across[2][3], per_length; /* the axes of views, and 1, divided by its length */
    mesher__view views[MESHER__VIEWS]; /* of the vertices last asked for */
    mesher__ring_filled rings[MESHER__RINGS], *ring; /* rings last asked for; the last one */
    uint32_t     num_cells, num_free, num_log, num_made, epoch;
    uint32_t     start;  /* a cell at a, where the way last began; 0: none */
    uint32_t     budget; /* edges that may be tried */
    uint32_t     ring_filled; /* vertices of a ring that is filled at most */
    uint64_t     work;
    int          full;   /* something had no room */
    int          apart;  /* removals that nest may share two tetrahedra at most */
    mesher__copy cells[MESHER__CELLS]; /* from 1 on */
    uint32_t     free_cells[MESHER__CELLS];
    uint32_t     changed[MESHER__CELLS / 32]; /* bits: cells that flips removed or made */
    uint32_t     slots[MESHER__CELL_SLOTS]; /* of copies, hashed: epoch, and number of the cell */
    uint32_t     log[MESHER__FLIP_LOG]; /* of each flip: cells removed, made, how many of either */
    uint32_t     made[MESHER__FLIP_LOG / 3][2]; /* edges that the flips of the log make, in order */
    uint32_t     edges[MESHER__END_DEPTH + 2][2]; /* those that wait to be removed */
    mesher__way  way[2];                 /* the current one, and that after flips */
    uint64_t     tried[3 * MESHER__WAY]; /* edges tried since the way last changed */
    uint32_t     num_tried;
} mesher__flips;
#  define MESHER__UNUSED UINT32_MAX /* an epoch: the tables are emptied at the first use */

/* The result of flips around a missing edge, independent of the copy that they were tried in. */
typedef struct mesher__flipped {
    uint32_t        num_old, num_new; /* tetrahedra removed, and made; 0: no flips */
    uint32_t        num_edges, num_facets, num_read;
    uint64_t        work;
    delaunay_handle start;  /* where the star of the edge's first end was entered */
    int             whole;  /* nothing had to be left out, neither here nor of read */
    /* tetrahedra removed, and those that the result depends on */
    delaunay_handle old[MESHER__FLIPPED], read[MESHER__FLIPPED_READ];
    uint32_t        edges[MESHER__FLIPPED_EDGES]; /* missing edges that flips made, some twice */
    uint32_t        facets[2 * MESHER__FLIPPED];  /* missing facets that they made */
    /* as delaunay_replace_linked takes them */
    uint32_t        vertices[4 * MESHER__FLIPPED];
    delaunay_handle link[4 * MESHER__FLIPPED];
    uint8_t         inside[4 * MESHER__FLIPPED];
    uint16_t        flags[MESHER__FLIPPED];
} mesher__flipped;

/* Bounds of r->work: for all that precedes the first interior point (half a minute or so), and for
 * all that follows (three times as long). An attempt by flips that uses them up is the last one, as
 * is a later attempt that uses as much as the first bound. */
#  define MESHER__WORK_FIRST ((uint64_t)1000000000)
#  define MESHER__WORK_THEN  ((uint64_t)3000000000)

typedef struct mesher__recovery {
    mesher_domain   *domain;
    delaunay_mesh   *mesh;
    mesher_report   *report;
    delaunay_memory *memory;
    delaunay_worker *worker;
    mesher_result    status;            /* the first failure; ends everything */
    /* Constraints are given by their mesh vertices, ascending. Row v lists those whose first vertex
     * is v; long rows are sorted. */
    uint32_t  num_rows;                 /* mesh vertices before any Steiner point was added */
    uint32_t  num_edges, num_facets;    /* those of the domain first, then pieces of split ones */
    uint32_t  cap_at;                   /* vertices that can have missing constraints */
    /* not a constraint now: it is split, or a piece of one that is whole again */
    uint8_t  *edge_retired, *facet_retired;
    uint32_t *edge_origin, *facet_origin;   /* of pieces: the domain's edge or facet they lie in */
    uint32_t *edge_slots, *facet_slots;     /* open addressing: 1 + index of a piece; 0 is free */
    mesher__split *splits;
    uint32_t  num_splits, max_pieces;
    uint32_t *edges, *edge_row, *edge_other, *edge_index;
    uint32_t *facets, *facet_row, *facet_second, *facet_third, *facet_index;
    uint8_t  *edge_present, *facet_present;
    uint8_t  *edge_seen, *facet_seen;   /* by place in the rows; edges: and one place more */
    uint32_t *missing_edges_at, *missing_facets_at; /* of each mesh vertex: their number */
    uint32_t  num_missing_edges, num_missing_facets;
    uint32_t *wanted, num_wanted;         /* a list of missing edges or facets */
    uint64_t *order;
    /* Patches: maximal flat parts of the surface, each named by a facet of it (mesher__patch is
     * something else). */
    uint32_t *patch_row, *patches; /* row v: the patches that vertex v is in */
    double   *patch_planes;        /* 4 for each patch: a unit normal n, and n.x of its points */
    /* for the edge or facet that is worked on */
    mesher__set     seen, seen_edges, known, known_near, failed;
    delaunay_list   queue, star, pool;
    uint32_t        num_windows;
    mesher__flips  *flips;            /* num_flips: one for each thread */
    mesher__flipped *flipped;         /* num_flipped: results of one batch, by all threads */
    uint32_t        num_flips, num_flipped;
    delaunay_crew   crew;             /* for the short loops that find them */
    delaunay_list   touched;          /* tetrahedra changed since then; their marks are set */
    int             notes;            /* commits add the tetrahedra that they make to touched */
    delaunay_list   came;             /* constrained edges that a commit makes */
    uint32_t        shell[MESHER__SHELL][3];     /* facets of a polyhedron, outward */
    delaunay_handle shell_beyond[MESHER__SHELL]; /* what is behind them; 0: a constraint */
    uint32_t        num_shell;
    delaunay_handle slots[MESHER__SHELL];        /* tetrahedra made by the last commit */
    uint32_t        commit[4 * MESHER__SHELL];   /* vertices of those to be made */
    uint32_t *journal; /* of the running transaction; of each commit: the vertices of the old
                          tetrahedra, those of the new ones, how many of either */
    size_t          num_journal, cap_journal;
    int             in_transaction;
    struct {
        double    step;
        uint32_t  num_buckets, *rows, *edges;
    } grid;                             /* over the missing edges of the list */
    uint64_t        random;
    int             from_ends;         /* flips are from one end of the edge */
    uint32_t        from_second;       /* 1: from the second one */
    int             far_too;           /* obstacles behind the first one are tried, too */
    int             attempt, by_flips; /* by_flips: this is one of the attempts by flips */
    uint64_t        nodes, searches, ticks;
    uint64_t        work, max_work;    /* predicates, about: a bound that depends on no clock */
    uint8_t        *hopeless;           /* of each edge: points that brought it no nearer */
    int             stuck;              /* interior points bring in few more edges */
    int             unmoved;            /* they brought in less than a quarter of many edges */
    int             stuck_in_planes;    /* flips have left many of the edges that were in planes */
    uint32_t        vain, max_vain;     /* points that brought nothing */
    uint32_t        added, removed;     /* Steiner points */
    int             defects;
    /* Work space, not zeroed. */
    mesher__pipe    pipe;
    mesher__window  windows[MESHER__MAX_WINDOWS];
    uint64_t        window_order[MESHER__MAX_WINDOWS];
    delaunay_window window;
    delaunay_search search;
    mesher__plane   plane;
    uint32_t        near_edges[MESHER__NEAR];
    /* rows of the linear program, by its dimension: in each at most one more than in the next */
    double          lp[5][MESHER__SHELL + 4][5];
} mesher__recovery;

/* -- sets */

static int mesher__compare_u64(const void *a, const void *b)
{
    uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return x < y ? -1 : x > y;
}

static uint64_t mesher__mix(uint64_t x)
{
    x ^= x >> 31;
    x *= 0x9E3779B97F4A7C15u;
    x ^= x >> 29;
    x *= 0xBF58476D1CE4E5B9u;
    return x ^ (x >> 32);
}

static void mesher__set_clear(mesher__set *set)
{
    set->count = 0;
    if (++set->epoch != 0) return;
    if (set->cap) memset(set->stamps, 0, set->cap * sizeof *set->stamps);
    set->epoch = 1;
}

/* Where a key is in a set that has room, or where it would be. */
static inline size_t mesher__set_slot(const mesher__set *set, uint64_t key)
{
    size_t j = (size_t)mesher__mix(key) & (set->cap - 1);
    while (set->stamps[j] == set->epoch && set->keys[j] != key) j = (j + 1) & (set->cap - 1);
    return j;
}

static int mesher__set_grow(mesher__set *set)
{
    mesher__set grown = *set;
    size_t i, j;
    if (grown.epoch == 0) grown.epoch = 1;
    grown.cap = set->cap ? 2 * set->cap : 256;
    grown.keys = (uint64_t *)delaunay_alloc(set->memory, grown.cap, sizeof *grown.keys);
    grown.stamps = (uint32_t *)delaunay_alloc(set->memory, grown.cap, sizeof *grown.stamps);
    if (!grown.keys || !grown.stamps) {
        delaunay_release(set->memory, grown.keys);
        delaunay_release(set->memory, grown.stamps);
        return 0;
    }
    memset(grown.stamps, 0, grown.cap * sizeof *grown.stamps);
    for (i = 0; i < set->cap; i++) {
        if (set->stamps[i] != grown.epoch) continue;
        j = mesher__set_slot(&grown, set->keys[i]);
        grown.keys[j] = set->keys[i];
        grown.stamps[j] = grown.epoch;
    }
    delaunay_release(set->memory, set->keys);
    delaunay_release(set->memory, set->stamps);
    *set = grown;
    return 1;
}

/* Returns 1: added, 0: was in the set already, -1: out of memory. */
static int mesher__set_add(mesher__set *set, uint64_t key)
{
    size_t j;
    if (2 * (set->count + 1) > set->cap && !mesher__set_grow(set)) return -1;
    j = mesher__set_slot(set, key);
    if (set->stamps[j] == set->epoch) return 0;
    set->keys[j] = key;
    set->stamps[j] = set->epoch;
    set->count++;
    return 1;
}

static int mesher__set_has(const mesher__set *set, uint64_t key)
{
    return set->cap && set->stamps[mesher__set_slot(set, key)] == set->epoch;
}

static void mesher__set_free(mesher__set *set)
{
    delaunay_release(set->memory, set->keys);
    delaunay_release(set->memory, set->stamps);
}

/* mesher__set_add, which notes in the recovery's status if memory runs out. Returns 1 if added. */
static int mesher__add(mesher__recovery *r, mesher__set *set, uint64_t key)
{
    int added = mesher__set_add(set, key);
    if (added < 0) r->status = MESHER_ERROR_OUT_OF_MEMORY;
    return added > 0;
}

static void mesher__note_failure(mesher__recovery *r, delaunay_result result)
{
    if (result != DELAUNAY_OK && r->status == MESHER_OK) r->status = mesher__from_delaunay(result);
}

static void mesher__push(mesher__recovery *r, delaunay_list *list, delaunay_handle t)
{
    mesher__note_failure(r, delaunay_list_push(list, t));
}

/* Lists the tetrahedra around a vertex in r->star. 0: recovery has failed. */
static int mesher__list_star(mesher__recovery *r, uint32_t v)
{
    mesher__note_failure(r, delaunay_vertex_star(r->mesh, r->worker, v, &r->star));
    return r->status == MESHER_OK;
}

static void *mesher__block(mesher__recovery *r, size_t count, size_t size)
{
    void *block = delaunay_alloc(r->memory, count ? count : 1, size);
    if (!block) r->status = MESHER_ERROR_OUT_OF_MEMORY;
    return block;
}

static void *mesher__zeros(mesher__recovery *r, size_t count, size_t size)
{
    void *block = mesher__block(r, count, size);
    if (block) memset(block, 0, (count ? count : 1) * size);
    return block;
}

/* count numbers that are not initialised, followed by some zeros. */
static uint32_t *mesher__numbers(mesher__recovery *r, size_t count, size_t zeros)
{
    uint32_t *block = (uint32_t *)mesher__block(r, count + zeros, sizeof *block);
    if (block) memset(block + count, 0, zeros * sizeof *block);
    return block;
}

/* Is this attempt over: failed, or with defects found? */
static int mesher__ends(const mesher__recovery *r)
{
    return r->status != MESHER_OK || r->defects;
}

/* Is an edge or a facet of the surface still missing? */
static int mesher__lacks(const mesher__recovery *r)
{
    return r->num_missing_edges || r->num_missing_facets;
}

/* Must the recovery end: an error, no work left, or cancelled? Asks the host once in 64 calls. */
static int mesher__stopped(mesher__recovery *r)
{
    const delaunay_host *host = &r->domain->options.host;
    if (r->status != MESHER_OK || r->work > r->max_work || (r->by_flips && r->vain > r->max_vain))
        return 1;
    if (host->progress && (r->ticks++ & 63) == 0) {
        uint32_t all = r->num_edges + r->num_facets + 1;
        double done = 1 - (double)(r->num_missing_edges + r->num_missing_facets) / all;
        if (host->progress(host->user, "recover", done)) r->status = MESHER_CANCELLED;
    }
    return r->status != MESHER_OK;
}

/* Logs the state of the recovery, if the host wants that. */
static void mesher__tell(mesher__recovery *r, const char *stage, int detail)
{
    const delaunay_host *host = &r->domain->options.host;
    char text[200];
    if (!host->log) return;
    snprintf(
        text, sizeof text,
        "recover: %s %d: %lu edges and %lu facets missing, %ld points, %.3g searches, %.3g nodes, "
        "work %.3g",
        stage, detail, (unsigned long)r->num_missing_edges, (unsigned long)r->num_missing_facets,
        (long)r->added - (long)r->removed, (double)r->searches, (double)r->nodes,
        (double)r->work);
    host->log(host->user, DELAUNAY_LOG_DEBUG, text);
}

/* -- constraints by their vertices */

/* The piece of a split edge between two vertices, or MESHER__ABSENT. */
static uint32_t mesher__edge_piece(const mesher__recovery *r, uint32_t a, uint32_t b)
{
    uint32_t mask = r->max_pieces * 2 - 1, j;
    if (!r->num_splits) return MESHER__ABSENT;
    for (j = (uint32_t)mesher__mix(mesher__pair(a, b)) & mask; r->edge_slots[j];
         j = (j + 1) & mask) {
        uint32_t e = r->edge_slots[j] - 1;
        if (r->edges[2 * (size_t)e] == (a < b ? a : b) &&
            r->edges[2 * (size_t)e + 1] == (a < b ? b : a) && !r->edge_retired[e])
            return e;
    }
    return MESHER__ABSENT;
}

static uint32_t mesher__facet_hash(const uint32_t *v)
{
    return (uint32_t)mesher__mix(mesher__pair(v[0], v[1]) + mesher__mix(v[2]));
}

/* The same of a facet, given by its vertices in ascending order. */
static uint32_t mesher__facet_piece(const mesher__recovery *r, const uint32_t *v)
{
    uint32_t mask = r->max_pieces * 2 - 1, j;
    if (!r->num_splits) return MESHER__ABSENT;
    for (j = mesher__facet_hash(v) & mask; r->facet_slots[j]; j = (j + 1) & mask) {
        uint32_t f = r->facet_slots[j] - 1;
        if (!memcmp(r->facets + 3 * (size_t)f, v, 3 * sizeof *v) && !r->facet_retired[f]) return f;
    }
    return MESHER__ABSENT;
}

/* The caller's triangle or line that a constraint is from. */
static uint32_t mesher__edge_source(const mesher__recovery *r, uint32_t e)
{
    if (e < r->domain->num_edges) return r->domain->edge_source[e];
    e = r->edge_origin[e - r->domain->num_edges];
    return e & MESHER__IN_FACET ? r->domain->facet_source[e & ~MESHER__IN_FACET]
                                : r->domain->edge_source[e];
}

static uint32_t mesher__facet_source(const mesher__recovery *r, uint32_t f)
{
    return r->domain
        ->facet_source[f < r->domain->num_facets ? f : r->facet_origin[f - r->domain->num_facets]];
}

/* -- rows: row v lists the constraints whose first (smallest) vertex is v; eight entries are
 * compared at a time, and in long rows, which are sorted, what can match is found by bisection */
#  define MESHER__ROW_BLOCK 8u
#  define MESHER__LONG_ROW 32u

/* Bit i is set if row[i] is x, for the first n of eight numbers. */
static unsigned mesher__matches(const uint32_t *row, uint32_t n, uint32_t x)
{
    unsigned bits = 0;
#  if defined(__GNUC__) && defined(__x86_64__) && !defined(DELAUNAY_NO_SIMD)
    __m128i key = _mm_set1_epi32((int)x);
    __m128i low = _mm_cmpeq_epi32(_mm_loadu_si128((const __m128i *)(const void *)row), key);
    __m128i high = _mm_cmpeq_epi32(_mm_loadu_si128((const __m128i *)(const void *)(row + 4)), key);
    __m128i all = _mm_packs_epi16(_mm_packs_epi32(low, high), _mm_setzero_si128());
    bits = (unsigned)_mm_movemask_epi8(all);
#  else
    unsigned i;
    for (i = 0; i < MESHER__ROW_BLOCK; i++) bits |= (unsigned)(row[i] == x) << i;
#  endif
    return bits & ((1u << (n < MESHER__ROW_BLOCK ? n : MESHER__ROW_BLOCK)) - 1);
}

/* The lowest bit that is set. */
static inline uint32_t mesher__lowest_bit(uint64_t bits)
{
#  if defined(__GNUC__)
    return (uint32_t)__builtin_ctzll(bits);
#  else
    uint32_t i = 0;
    while (!(bits >> i & 1)) i++;
    return i;
#  endif
}

/* The first of the places low .. high - 1 of a sorted row that may hold x; high: none. */
static uint32_t mesher__halve_row(const uint32_t *row, uint32_t low, uint32_t high, uint32_t x)
{
    while (low < high) {
        uint32_t middle = low + (high - low) / 2;
        if (row[middle] < x) low = middle + 1;
        else high = middle;
    }
    return low;
}

/* The place of edge ab, a < b, in its row, or MESHER__ABSENT. */
static uint32_t mesher__edge_place(const mesher__recovery *r, uint32_t a, uint32_t b)
{
    uint32_t low = r->edge_row[a], high = r->edge_row[a + 1];
    if (high - low > MESHER__LONG_ROW) {
        low = mesher__halve_row(r->edge_other, low, high, b);
        return low < high && r->edge_other[low] == b ? low : MESHER__ABSENT;
    }
    for (; low < high; low += MESHER__ROW_BLOCK) {
        unsigned found = mesher__matches(r->edge_other + low, high - low, b);
        if (found) return low + mesher__lowest_bit(found);
    }
    return MESHER__ABSENT;
}

/* The place of a facet, given by its vertices in ascending order, in its row, or MESHER__ABSENT. */
static uint32_t mesher__facet_place(const mesher__recovery *r, const uint32_t *v)
{
    uint32_t low = r->facet_row[v[0]], high = r->facet_row[v[0] + 1];
    if (high - low > MESHER__LONG_ROW) {
        low = mesher__halve_row(r->facet_second, low, high, v[1]);
        high = mesher__halve_row(r->facet_second, low, high, v[1] + 1);
    }
    for (; low < high; low += MESHER__ROW_BLOCK) {
        unsigned found = mesher__matches(r->facet_second + low, high - low, v[1]) &
                         mesher__matches(r->facet_third + low, high - low, v[2]);
        if (found) return low + mesher__lowest_bit(found);
    }
    return MESHER__ABSENT;
}

/* The constrained edge between two mesh vertices, or MESHER__ABSENT. */
static uint32_t mesher__edge_index(const mesher__recovery *r, uint32_t a, uint32_t b)
{
    uint32_t low = a < b ? a : b, high = a < b ? b : a, place;
    if (high >= r->num_rows) return mesher__edge_piece(r, low, high);
    place = mesher__edge_place(r, low, high);
    if (place == MESHER__ABSENT) return mesher__edge_piece(r, low, high);
    return r->edge_retired[r->edge_index[place]] ? MESHER__ABSENT : r->edge_index[place];
}

static uint32_t mesher__facet_index(const mesher__recovery *r, uint32_t a, uint32_t b, uint32_t c)
{
    uint32_t v[3], place;
    v[0] = a;
    v[1] = b;
    v[2] = c;
    (void)mesher__ascend(v);
    if (v[2] >= r->num_rows) return mesher__facet_piece(r, v);
    place = mesher__facet_place(r, v);
    return place == MESHER__ABSENT || r->facet_retired[r->facet_index[place]]
               ? MESHER__ABSENT
               : r->facet_index[place];
}

static void mesher__set_edge_present(mesher__recovery *r, uint32_t e, int present)
{
    const uint32_t *v = r->edges + 2 * (size_t)e;
    if (r->edge_present[e] == (uint8_t)present) return;
    r->edge_present[e] = (uint8_t)present;
    r->num_missing_edges += present ? ~0u : 1u;
    r->missing_edges_at[v[0]] += present ? ~0u : 1u;
    r->missing_edges_at[v[1]] += present ? ~0u : 1u;
}

static void mesher__set_facet_present(mesher__recovery *r, uint32_t f, int present)
{
    const uint32_t *v = r->facets + 3 * (size_t)f;
    int k;
    if (r->facet_present[f] == (uint8_t)present) return;
    r->facet_present[f] = (uint8_t)present;
    r->num_missing_facets += present ? ~0u : 1u;
    for (k = 0; k < 3; k++) r->missing_facets_at[v[k]] += present ? ~0u : 1u;
}

/* Sorts items by their first vertices, stably, into index: those of vertex v are at the places
 * rows[v] .. rows[v + 1] - 1. rows is zeroed before. */
static void mesher__deal_rows(const uint32_t *vertices, uint32_t columns, uint32_t count,
                              uint32_t *rows, uint32_t num_rows, uint32_t *index)
{
    uint32_t i;
    for (i = 0; i < count; i++) rows[vertices[(size_t)columns * i]]++;
    for (i = 1; i <= num_rows; i++) rows[i] += rows[i - 1];
    for (i = count; i-- > 0;) index[--rows[vertices[(size_t)columns * i]]] = i;
}

/* Sorts long rows by second vertices, stably. */
static void mesher__sort_long_rows(const uint32_t *vertices, uint32_t columns, const uint32_t *rows,
                                   uint32_t num_rows, uint32_t *index, uint64_t *scratch)
{
    uint32_t v, i;
    for (v = 0; v < num_rows; v++) {
        uint32_t *row = index + rows[v], n = rows[v + 1] - rows[v];
        if (n <= MESHER__LONG_ROW) continue;
        for (i = 0; i < n; i++)
            scratch[i] = (uint64_t)vertices[(size_t)columns * row[i] + 1] << 32 | row[i];
        qsort(scratch, n, sizeof *scratch, mesher__compare_u64);
        for (i = 0; i < n; i++) row[i] = (uint32_t)scratch[i];
    }
}

/* The domain's edges as mesh vertices, and their rows. */
static void mesher__build_edge_rows(mesher__recovery *r)
{
    const mesher_domain *d = r->domain;
    const uint32_t *vertex_of = d->mesh.vertex_of;
    uint32_t i;
    for (i = 0; i < d->num_edges; i++) {
        uint32_t *v = r->edges + 2 * (size_t)i;
        uint32_t a = vertex_of[d->edges[2 * (size_t)i]], b = vertex_of[d->edges[2 * (size_t)i + 1]];
        v[0] = a < b ? a : b;
        v[1] = a < b ? b : a;
    }
    mesher__deal_rows(r->edges, 2, d->num_edges, r->edge_row, r->num_rows, r->edge_index);
    mesher__sort_long_rows(r->edges, 2, r->edge_row, r->num_rows, r->edge_index, r->order);
    for (i = 0; i < d->num_edges; i++)
        r->edge_other[i] = r->edges[2 * (size_t)r->edge_index[i] + 1];
}

static void mesher__build_facet_rows(mesher__recovery *r)
{
    const mesher_domain *d = r->domain;
    const uint32_t *vertex_of = d->mesh.vertex_of;
    uint32_t i, k;
    for (i = 0; i < d->num_facets; i++) {
        uint32_t *v = r->facets + 3 * (size_t)i;
        for (k = 0; k < 3; k++) v[k] = vertex_of[d->facets[3 * (size_t)i + k]];
        (void)mesher__ascend(v);
    }
    mesher__deal_rows(r->facets, 3, d->num_facets, r->facet_row, r->num_rows, r->facet_index);
    mesher__sort_long_rows(r->facets, 3, r->facet_row, r->num_rows, r->facet_index,
                           r->order + d->num_edges);
    for (i = 0; i < d->num_facets; i++) {
        r->facet_second[i] = r->facets[3 * (size_t)r->facet_index[i] + 1];
        r->facet_third[i] = r->facets[3 * (size_t)r->facet_index[i] + 2];
    }
}

/* Calls both functions, in two threads if that is worthwhile; what they share is only read. */
static void mesher__do_both(mesher__recovery *r, void (*edges)(mesher__recovery *),
                            void (*facets)(mesher__recovery *))
{
    size_t steps = (size_t)r->domain->num_edges + r->domain->num_facets;
    int threads = delaunay_threads_for(&r->domain->options.host, steps) > 1 ? 2 : 1, i;
    (void)threads;
    MESHER__OMP(omp parallel for num_threads(threads))
    for (i = 0; i < 2; i++) {
        if (i == 0) edges(r);
        else facets(r);
    }
}

/* -- what is missing */

/* The place of edge ab in the rows, or, if it is no edge of the domain, the place after the last
 * one. Unless the row is longer than a block, no branch depends on which of the two it is. */
static inline uint32_t mesher__edge_place_or_end(const mesher__recovery *r, uint32_t a, uint32_t b)
{
    uint32_t first = a < b ? a : b, other = a < b ? b : a, end = r->domain->num_edges;
    uint32_t low = r->edge_row[first], n = r->edge_row[first + 1] - low, none;
    unsigned found = mesher__matches(r->edge_other + low, n, other);
    if (n > MESHER__ROW_BLOCK && !found) {
        low = mesher__edge_place(r, first, other);
        return low == MESHER__ABSENT ? end : low;
    }
    none = (uint32_t)(found == 0) * UINT32_MAX;
    return ((low + mesher__lowest_bit(found | 1u << MESHER__ROW_BLOCK)) & ~none) | (end & none);
}

/* The flag bits of the three edges of facet k. */
static unsigned mesher__facet_edges(int k)
{
    static const uint8_t around[4] = {1 << 3 | 1 << 4 | 1 << 5, 1 << 1 | 1 << 2 | 1 << 5,
                                      1 << 0 | 1 << 2 | 1 << 4, 1 << 0 | 1 << 1 | 1 << 3};
    return around[k] * DELAUNAY_EDGE_BIT(0);
}

/* Notes which constrained facets a tetrahedron has, and returns their flag bits. edges: the flag
 * bits of its constrained edges. */
static unsigned mesher__detect_facets(mesher__recovery *r, const uint32_t *v, unsigned edges)
{
    unsigned flags = 0;
    uint32_t place, w[3];
    int i;
    for (i = 0; i < 4; i++) {
        const uint8_t *o = delaunay_facet_order(i);
        if (mesher__facet_edges(i) & ~edges) continue;
        w[0] = v[o[0]];
        w[1] = v[o[1]];
        w[2] = v[o[2]];
        (void)mesher__ascend(w);
        place = mesher__facet_place(r, w);
        if (place == MESHER__ABSENT) continue;
        flags |= DELAUNAY_FACET_BIT(i);
        MESHER__STORE(&r->facet_seen[place], (uint8_t)1);
    }
    return flags;
}

/* Marks the constrained edges and facets of one tetrahedron, and notes that the mesh has them. */
static void mesher__detect_in(mesher__recovery *r, delaunay_handle t)
{
    const uint32_t *v = r->mesh->tets[t].v;
    uint32_t place[6], end = r->domain->num_edges;
    uint8_t *seen = r->edge_seen;
    unsigned edges = 0, flags;
    int i;
    place[0] = mesher__edge_place_or_end(r, v[0], v[1]);
    place[1] = mesher__edge_place_or_end(r, v[0], v[2]);
    place[2] = mesher__edge_place_or_end(r, v[0], v[3]);
    place[3] = mesher__edge_place_or_end(r, v[1], v[2]);
    place[4] = mesher__edge_place_or_end(r, v[1], v[3]);
    place[5] = mesher__edge_place_or_end(r, v[2], v[3]);
    for (i = 0; i < 6; i++) {
        MESHER__STORE(&seen[place[i]], (uint8_t)1);
        edges |= (unsigned)(place[i] != end) << i;
    }
    flags = edges * DELAUNAY_EDGE_BIT(0);
    if (flags) flags |= mesher__detect_facets(r, v, flags);
    r->mesh->flags[t] = (uint16_t)flags;
}

/* Takes over which edges were seen in the mesh, and counts those that were not. */
static void mesher__count_missing_edges(mesher__recovery *r)
{
    uint32_t i, k;
    for (i = 0; i < r->domain->num_edges; i++) r->edge_present[r->edge_index[i]] = r->edge_seen[i];
    for (i = 0; i < r->domain->num_edges; i++) {
        if (r->edge_present[i]) continue;
        r->num_missing_edges++;
        for (k = 0; k < 2; k++) r->missing_edges_at[r->edges[2 * (size_t)i + k]]++;
    }
}

static void mesher__count_missing_facets(mesher__recovery *r)
{
    uint32_t i, k;
    for (i = 0; i < r->domain->num_facets; i++)
        r->facet_present[r->facet_index[i]] = r->facet_seen[i];
    for (i = 0; i < r->domain->num_facets; i++) {
        if (r->facet_present[i]) continue;
        r->num_missing_facets++;
        for (k = 0; k < 3; k++) r->missing_facets_at[r->facets[3 * (size_t)i + k]]++;
    }
}

/* Finds what is missing by a sweep over all tetrahedra. The threads share the rows, which they only
 * read, and edge_seen and facet_seen, bytes that are only ever set to 1; each tetrahedron's flags
 * are written by one thread. */
static void mesher__detect(mesher__recovery *r)
{
    const delaunay_mesh *mesh = r->mesh;
    int threads = delaunay_threads_for(&r->domain->options.host, mesh->num_tets);
    int64_t t, n = (int64_t)mesh->num_tets;
    (void)threads;
    MESHER__OMP(omp parallel for schedule(static, 4096) num_threads(threads))
    for (t = 1; t < n; t++)
        if (!delaunay_is_deleted(mesh, (delaunay_handle)t) &&
            !delaunay_is_ghost(mesh, (delaunay_handle)t))
            mesher__detect_in(r, (delaunay_handle)t);
    mesher__do_both(r, mesher__count_missing_edges, mesher__count_missing_facets);
}

/* -- commits, and how they are taken back */

/* Counts the constraints of tetrahedra that are about to be removed as missing, until they are met
 * again in new ones. */
static void mesher__account_old(mesher__recovery *r, const delaunay_handle *old, size_t count)
{
    size_t i;
    int k;
    for (i = 0; i < count; i++) {
        const uint32_t *v = r->mesh->tets[old[i]].v;
        unsigned flags = r->mesh->flags[old[i]];
        for (k = 0; k < 6 && (flags & DELAUNAY_EDGE_BITS); k++) {
            const uint8_t *o = delaunay_edge_order(k);
            uint32_t e = flags & DELAUNAY_EDGE_BIT(k) ? mesher__edge_index(r, v[o[0]], v[o[1]])
                                                      : MESHER__ABSENT;
            if (e != MESHER__ABSENT) mesher__set_edge_present(r, e, 0);
        }
        for (k = 0; k < 4 && (flags & DELAUNAY_FACET_BITS); k++) {
            const uint8_t *o = delaunay_facet_order(k);
            uint32_t f = flags & DELAUNAY_FACET_BIT(k)
                             ? mesher__facet_index(r, v[o[0]], v[o[1]], v[o[2]])
                             : MESHER__ABSENT;
            if (f != MESHER__ABSENT) mesher__set_facet_present(r, f, 0);
        }
    }
}

/* Marks the missing edges that are among those of new tetrahedra, and counts them as present. All
 * tetrahedra around an edge that this commit makes are new, so all of them are marked. */
static void mesher__account_new_edges(mesher__recovery *r, const delaunay_handle *slots,
                                      size_t count)
{
    delaunay_mesh *mesh = r->mesh;
    size_t i;
    int k;
    r->came.count = 0;
    for (i = 0; i < count; i++)
        for (k = 0; k < 6; k++) {
            const uint8_t *o = delaunay_edge_order(k);
            uint32_t a = mesh->tets[slots[i]].v[o[0]], b = mesh->tets[slots[i]].v[o[1]], e;
            if (a >= r->cap_at || b >= r->cap_at || !r->missing_edges_at[a] ||
                !r->missing_edges_at[b])
                continue;
            e = mesher__edge_index(r, a, b);
            if (e == MESHER__ABSENT) continue;
            mesh->flags[slots[i]] = (uint16_t)(mesh->flags[slots[i]] | DELAUNAY_EDGE_BIT(k));
            mesher__push(r, &r->came, e);
        }
    for (i = 0; i < r->came.count; i++)
        mesher__set_edge_present(r, (uint32_t)r->came.items[i], 1);
}

/* Facet k of a tetrahedron with vertices v as a missing facet, or MESHER__ABSENT. */
static uint32_t mesher__missing_facet(const mesher__recovery *r, const uint32_t *v, int k)
{
    const uint8_t *o = delaunay_facet_order(k);
    int j;
    for (j = 0; j < 3; j++)
        if (v[o[j]] >= r->cap_at || !r->missing_facets_at[v[o[j]]]) return MESHER__ABSENT;
    return mesher__facet_index(r, v[o[0]], v[o[1]], v[o[2]]);
}

/* Counts a facet of a new tetrahedron as present, and marks it, if it is a missing one. */
static void mesher__account_facet(mesher__recovery *r, delaunay_handle t, int k)
{
    unsigned flags = r->mesh->flags[t], edges = mesher__facet_edges(k);
    uint32_t f;
    if ((flags & edges) != edges) return;
    f = mesher__missing_facet(r, r->mesh->tets[t].v, k);
    if (f == MESHER__ABSENT) return;
    mesher__set_facet_present(r, f, 1);
    if (!(flags & DELAUNAY_FACET_BIT(k)))
        delaunay_mark_facet(r->mesh, 4 * t + (delaunay_handle)k, 1);
}

/* The same for all facets of new tetrahedra, whose edges are marked already. */
static void mesher__account_new_facets(mesher__recovery *r, const delaunay_handle *slots,
                                       size_t count)
{
    size_t i;
    int k;
    for (i = 0; i < count && r->num_missing_facets; i++)
        for (k = 0; k < 4; k++) mesher__account_facet(r, slots[i], k);
}

/* Counts the constraints of new tetrahedra as present, and marks those that this commit made; the
 * others kept their marks. */
static void mesher__account_new(mesher__recovery *r, const delaunay_handle *slots, size_t count)
{
    if (r->num_missing_edges) mesher__account_new_edges(r, slots, count);
    mesher__account_new_facets(r, slots, count);
}

/* Makes room for more numbers in the journal; 0: no memory. */
static int mesher__journal_room(mesher__recovery *r, size_t more)
{
    if (mesher__room(r->memory, &r->journal, &r->cap_journal, r->num_journal,
                     r->num_journal + more, sizeof *r->journal))
        return 1;
    r->status = MESHER_ERROR_OUT_OF_MEMORY;
    return 0;
}

static void mesher__note_change(mesher__recovery *r, delaunay_handle t)
{
    if (t == 0) return;
    r->mesh->mark[t] = 1;
    mesher__push(r, &r->touched, t);
}

static void mesher__note_new(mesher__recovery *r, size_t count)
{
    size_t i;
    for (i = 0; r->notes && i < count; i++) mesher__note_change(r, r->slots[i]);
}

static void mesher__forget_changes(mesher__recovery *r)
{
    size_t i;
    for (i = 0; i < r->touched.count; i++) r->mesh->mark[r->touched.items[i]] = 0;
    r->touched.count = 0;
}

/* delaunay_replace, which also keeps count of the constraints and enters the step in the journal of
 * a running transaction. Returns 1 if done. */
static int mesher__commit(mesher__recovery *r, const delaunay_handle *old, size_t num_old,
                          const uint32_t *vertices, size_t num_new)
{
    delaunay_result result;
    uint32_t *entry;
    size_t i, k, total = 4 * (num_old + num_new) + 2;
    if (num_new > MESHER__SHELL) return 0;
    if (r->in_transaction) {
        if (!mesher__journal_room(r, total)) return 0;
        entry = r->journal + r->num_journal;
        for (i = 0; i < num_old; i++)
            for (k = 0; k < 4; k++) *entry++ = r->mesh->tets[old[i]].v[k];
        memcpy(entry, vertices, 4 * num_new * sizeof *entry);
        entry[4 * num_new] = (uint32_t)num_old;
        entry[4 * num_new + 1] = (uint32_t)num_new;
    }
    mesher__account_old(r, old, num_old);
    result = delaunay_replace(r->mesh, r->worker, old, num_old, vertices, num_new, r->slots);
    if (result != DELAUNAY_OK) {
        mesher__account_new(r, old, num_old);
        mesher__note_failure(r, result);
        return 0;
    }
    if (r->in_transaction) r->num_journal += total;
    mesher__account_new(r, r->slots, num_new);
    mesher__note_new(r, num_new);
    return r->status == MESHER_OK;
}

static void mesher__begin(mesher__recovery *r)
{
    r->in_transaction = 1;
    r->num_journal = 0;
}

/* The tetrahedron with these vertices, or 0. */
static delaunay_handle mesher__find_tet(mesher__recovery *r, const uint32_t *v)
{
    delaunay_handle f = delaunay_find_facet(r->mesh, r->worker, v[0], v[1], v[2]);
    if (f == 0) return 0;
    if (delaunay_local_index(&r->mesh->tets[f / 4], v[3]) >= 0) return f / 4;
    f = r->mesh->tets[f / 4].n[f % 4];
    return f && delaunay_local_index(&r->mesh->tets[f / 4], v[3]) >= 0 ? f / 4 : 0;
}

/* Takes back the steps in the journal, the last one first. */
static void mesher__roll_back(mesher__recovery *r)
{
    delaunay_handle old[MESHER__SHELL];
    r->in_transaction = 0;
    while (r->num_journal > 0 && r->status == MESHER_OK) {
        const uint32_t *end = r->journal + r->num_journal;
        uint32_t num_new = end[-1], num_old = end[-2], i;
        const uint32_t *made = end - 2 - 4 * (size_t)num_new, *was = made - 4 * (size_t)num_old;
        for (i = 0; i < num_new; i++) {
            old[i] = mesher__find_tet(r, made + 4 * (size_t)i);
            if (!old[i]) {
                r->status = MESHER_ERROR_INTERNAL;
                return;
            }
        }
        if (!mesher__commit(r, old, num_new, was, num_old)) return;
        r->num_journal -= 4 * ((size_t)num_old + num_new) + 2;
    }
}

/* ---- >>pipes  what a missing edge or facet crosses; windows around it --------------------- */

static const double *mesher__x(const mesher__recovery *r, uint32_t v)
{
    return r->mesh->vertices[v].x;
}

/* The sign of orientation of facet f and x; below 0: x is inside the shell's facet f. */
static int mesher__facet_side(const mesher__recovery *r, const uint32_t *f, const double *x)
{
    return delaunay_orient3d(mesher__x(r, f[0]), mesher__x(r, f[1]), mesher__x(r, f[2]), x);
}

/* Adds the tetrahedra around a mesh edge to the queue. */
static void mesher__queue_star(mesher__recovery *r, delaunay_handle t, uint32_t a, uint32_t b)
{
    size_t i;
    mesher__note_failure(r, delaunay_edge_star(r->mesh, r->worker, t, a, b, &r->star));
    for (i = 0; i < r->star.count && r->status == MESHER_OK; i++)
        if (mesher__add(r, &r->seen, r->star.items[i]))
            mesher__push(r, &r->queue, r->star.items[i]);
}

static void mesher__pipe_clear(mesher__recovery *r)
{
    mesher__pipe *p = &r->pipe;
    p->num_crossings = p->num_edges = p->num_tets = 0;
    p->too_long = p->blocked = 0;
    p->vertex = 0;
    r->queue.count = 0;
    mesher__set_clear(&r->seen);
    mesher__set_clear(&r->seen_edges);
}

static void mesher__pipe_block(mesher__pipe *p, int vertices, uint32_t a, uint32_t b, uint32_t c)
{
    p->blocked = vertices;
    p->blocker[0] = a;
    p->blocker[1] = b;
    p->blocker[2] = c;
}

/* Where ab meets the plane of a face, about: 0 at a, 1 at b. */
static double mesher__where(const mesher__recovery *r, uint32_t a, uint32_t b, const uint32_t *face)
{
    const double *p = mesher__x(r, face[0]), *q = mesher__x(r, face[1]), *s = mesher__x(r, face[2]);
    const double *x = mesher__x(r, a), *y = mesher__x(r, b);
    double u[3], v[3], n[3], da = 0, db = 0;
    int k;
    for (k = 0; k < 3; k++) {
        u[k] = q[k] - p[k];
        v[k] = s[k] - p[k];
    }
    for (k = 0; k < 3; k++)
        n[k] = u[(k + 1) % 3] * v[(k + 2) % 3] - u[(k + 2) % 3] * v[(k + 1) % 3];
    for (k = 0; k < 3; k++) {
        da += n[k] * (x[k] - p[k]);
        db += n[k] * (y[k] - p[k]);
    }
    return da - db != 0 ? da / (da - db) : 0.5;
}

/* Notes that ab crosses facet i of t. zeros: as delaunay_segment_crosses sets it. Returns 0 if the
 * walk ends here. */
static int mesher__cross_face(mesher__recovery *r, uint32_t a, uint32_t b, delaunay_handle t, int i,
                              int zeros)
{
    mesher__pipe *p = &r->pipe;
    const uint8_t *o = delaunay_facet_order(i);
    const delaunay_tet *tet = &r->mesh->tets[t];
    uint32_t w[3];
    delaunay_handle other = tet->n[i] / 4;
    int k;
    for (k = 0; k < 3; k++) w[k] = tet->v[o[k]];
    if (zeros & (zeros - 1)) {
        p->vertex = w[zeros == 3 ? 1 : zeros == 6 ? 2 : 0];
        return 0;
    }
    if (zeros) {
        k = zeros == 1 ? 0 : zeros == 2 ? 1 : 2;
        if (r->mesh->flags[t] & DELAUNAY_EDGE_BIT(delaunay_edge_between(o[k], o[(k + 1) % 3]))) {
            mesher__pipe_block(p, 2, w[k], w[(k + 1) % 3], 0);
            return 0;
        }
    } else if (r->mesh->flags[t] & DELAUNAY_FACET_BIT(i)) {
        mesher__pipe_block(p, 3, w[0], w[1], w[2]);
        return 0;
    }
    if (other && t < other) {
        mesher__crossing *c;
        double where = mesher__where(r, a, b, w);
        uint32_t j = p->num_crossings;
        if (j == MESHER__PIPE) {
            p->too_long = 1;
            return 0;
        }
        p->num_crossings++;
        for (; j > 0 && p->crossings[j - 1].where > where; j--)
            p->crossings[j] = p->crossings[j - 1];
        c = &p->crossings[j];
        c->tets[0] = t;
        c->tets[1] = other;
        c->facet = i;
        c->where = where;
    }
    if (other && mesher__add(r, &r->seen, other)) mesher__push(r, &r->queue, other);
    if (zeros) mesher__queue_star(r, t, w[k], w[(k + 1) % 3]);
    return 1;
}

static int mesher__pipe_tet(mesher__pipe *p, delaunay_handle t)
{
    if (p->num_tets == MESHER__PIPE) {
        p->too_long = 1;
        return 0;
    }
    p->tets[p->num_tets++] = t;
    return 1;
}

/* The pipe of ab: all faces that it crosses, from the star of a on. Ends early at a vertex on ab or
 * at a constraint that ab crosses. */
static void mesher__walk_edge(mesher__recovery *r, uint32_t a, uint32_t b)
{
    size_t h;
    int i, zeros;
    mesher__pipe_clear(r);
    mesher__note_failure(r, delaunay_vertex_star(r->mesh, r->worker, a, &r->queue));
    for (h = 0; h < r->queue.count; h++) mesher__add(r, &r->seen, r->queue.items[h]);
    for (h = 0; h < r->queue.count && r->status == MESHER_OK; h++) {
        delaunay_handle t = r->queue.items[h];
        const uint32_t *v = r->mesh->tets[t].v;
        int hit = 0;
        if (v[3] == DELAUNAY_GHOST) continue;
        for (i = 0; i < 4; i++) {
            const uint8_t *o = delaunay_facet_order(i);
            if (!delaunay_segment_crosses(r->mesh, a, b, v[o[0]], v[o[1]], v[o[2]], &zeros))
                continue;
            hit = 1;
            if (!mesher__cross_face(r, a, b, t, i, zeros)) return;
        }
        if (hit && !mesher__pipe_tet(&r->pipe, t)) break;
    }
    r->work += 4 * h;
}

/* Does v lie in the open triangle f, exactly? off: any vertex that is not in its plane. */
static int mesher__inside_facet(const mesher__recovery *r, const uint32_t *f, uint32_t v,
                                uint32_t off)
{
    int k, s[3];
    if (v == DELAUNAY_GHOST || v == f[0] || v == f[1] || v == f[2]) return 0;
    if (mesher__facet_side(r, f, mesher__x(r, v))) return 0;
    for (k = 0; k < 3; k++)
        s[k] = delaunay_orient3d(mesher__x(r, f[k]), mesher__x(r, f[(k + 1) % 3]), mesher__x(r, v),
                                 mesher__x(r, off));
    return s[0] && s[0] == s[1] && s[1] == s[2];
}

/* A vertex off the plane of facet f: one of the box's corners, which are not all in one plane. */
static uint32_t mesher__off_plane(const mesher__recovery *r, const uint32_t *f)
{
    uint32_t i, v = 0;
    for (i = 0; i < 8; i++) {
        v = r->mesh->vertex_of[r->domain->first_corner + i];
        if (mesher__facet_side(r, f, mesher__x(r, v))) break;
    }
    return v;
}

/* The pipe of a facet whose three edges are in the mesh: the mesh edges that pierce it. If they are
 * too many, it has those that are met first on the way inwards from the facet's edges. */
static void mesher__walk_facet(mesher__recovery *r, const uint32_t *f)
{
    mesher__pipe *p = &r->pipe;
    uint32_t off = mesher__off_plane(r, f);
    size_t h;
    int k, i;
    mesher__pipe_clear(r);
    for (k = 0; k < 3; k++) {
        delaunay_handle t = delaunay_find_edge(r->mesh, r->worker, f[k], f[(k + 1) % 3]);
        if (t) mesher__queue_star(r, t, f[k], f[(k + 1) % 3]);
    }
    for (h = 0; h < r->queue.count && r->status == MESHER_OK; h++) {
        delaunay_handle t = r->queue.items[h];
        const delaunay_tet *tet = &r->mesh->tets[t];
        uint32_t w[4];
        int hit = 0;
        if (tet->v[3] == DELAUNAY_GHOST) continue;
        memcpy(w, tet->v, sizeof w);
        for (i = 0; i < 4; i++)
            if (mesher__inside_facet(r, f, w[i], off)) {
                p->vertex = w[i];
                return;
            }
        for (i = 0; i < 6; i++) {
            uint32_t a = w[delaunay_edge_order(i)[0]], b = w[delaunay_edge_order(i)[1]];
            if (!delaunay_segment_crosses(r->mesh, a, b, f[0], f[1], f[2], NULL)) continue;
            hit = 1;
            if (!mesher__add(r, &r->seen_edges, mesher__pair(a, b))) continue;
            if (r->mesh->flags[t] & DELAUNAY_EDGE_BIT(i)) {
                mesher__pipe_block(p, 2, a, b, 0);
                return;
            }
            if (p->num_edges == MESHER__PIPE) return;
            p->edges[p->num_edges][0] = a;
            p->edges[p->num_edges][1] = b;
            p->edge_tets[p->num_edges++] = t;
            mesher__queue_star(r, t, a, b);
        }
        if (hit && !mesher__pipe_tet(p, t)) return;
    }
}

/* -- windows: small sets of tetrahedra around what is missing */

/* A tetrahedron's share in the signature of a window: a function of its vertices alone, not of its
 * slot or their order. */
static uint64_t mesher__tet_signature(const delaunay_tet *t)
{
    uint64_t a = mesher__mix(t->v[0]), b = mesher__mix(t->v[1]), c = mesher__mix(t->v[2]),
             d = mesher__mix(t->v[3]);
    return mesher__mix((a ^ b ^ c ^ d) + (a + b + c + d) * 3);
}

static void mesher__windows_clear(mesher__recovery *r)
{
    r->num_windows = 0;
    r->pool.count = 0;
    mesher__set_clear(&r->known);
}

/* Orders the windows by numbers of vertices, then of tetrahedra, then as they came. */
static void mesher__windows_sort(mesher__recovery *r)
{
    uint32_t i;
    for (i = 0; i < r->num_windows; i++)
        r->window_order[i] =
            (uint64_t)r->windows[i].num_points << 48 | (uint64_t)r->windows[i].num_tets << 32 | i;
    if (r->num_windows > 1)
        qsort(r->window_order, r->num_windows, sizeof *r->window_order, mesher__compare_u64);
    r->work += 10 * (uint64_t)r->num_windows + r->pool.count;
}

/* A set of tetrahedra under construction, which may become a window. */
typedef struct mesher__patch {
    uint32_t        count, num_points;
    int             full;
    uint64_t        bits; /* a filter: a tetrahedron whose bit is not set is not in the patch */
    uint64_t        signature;
    uint32_t        points[DELAUNAY_WINDOW_VERTICES];
    delaunay_handle tets[DELAUNAY_WINDOW_TETS]; /* last: mesher__patch_copy copies a part */
} mesher__patch;

static uint64_t mesher__tet_bit(delaunay_handle t) { return (uint64_t)1 << (t & 63); }

static int mesher__patch_has(const mesher__patch *p, delaunay_handle t)
{
    uint32_t i;
    if (!(p->bits & mesher__tet_bit(t))) return 0;
    for (i = 0; i < p->count; i++)
        if (p->tets[i] == t) return 1;
    return 0;
}

static void mesher__patch_copy(mesher__patch *p, const mesher__patch *from)
{
    memcpy(p, from, offsetof(mesher__patch, tets) + from->count * sizeof *from->tets);
}

static int mesher__patch_has_point(const mesher__patch *p, uint32_t v)
{
    uint32_t i;
    for (i = p->num_points; i > 0 && p->points[i - 1] != v; i--) {}
    return i > 0;
}

static void mesher__patch_add(const mesher__recovery *r, mesher__patch *p, delaunay_handle t)
{
    const delaunay_tet *tet = &r->mesh->tets[t];
    int k;
    if (mesher__patch_has(p, t)) return;
    p->full |= p->count == DELAUNAY_WINDOW_TETS;
    for (k = 0; k < 4 && !p->full; k++) {
        if (mesher__patch_has_point(p, tet->v[k])) continue;
        p->full = p->num_points == DELAUNAY_WINDOW_VERTICES;
        if (!p->full) p->points[p->num_points++] = tet->v[k];
    }
    if (p->full) return;
    p->tets[p->count++] = t;
    p->bits |= mesher__tet_bit(t);
    p->signature += mesher__tet_signature(tet);
}

static void mesher__patch_union(const mesher__recovery *r, mesher__patch *p,
                                const delaunay_handle *tets, size_t count)
{
    size_t i;
    for (i = 0; i < count && !p->full; i++) mesher__patch_add(r, p, tets[i]);
}

static void mesher__patch_set(const mesher__recovery *r, mesher__patch *p,
                              const delaunay_handle *tets, size_t count)
{
    p->full = 0;
    p->count = p->num_points = 0;
    p->bits = p->signature = 0;
    mesher__patch_union(r, p, tets, count);
}

/* Makes a window of a patch of at most max_points vertices, unless that exists. Returns 0 if the
 * patch, and so all that contain it, are too large, or there is no room. */
static int mesher__patch_note(mesher__recovery *r, const mesher__patch *p, uint32_t max_points)
{
    mesher__window *w;
    uint32_t i;
    if (p->full || p->count == 0 || p->num_points > max_points ||
        r->num_windows == MESHER__MAX_WINDOWS)
        return 0;
    if (!mesher__add(r, &r->known, p->signature)) return 1;
    w = &r->windows[r->num_windows++];
    w->signature = p->signature;
    w->first = (uint32_t)r->pool.count;
    w->num_tets = p->count;
    w->num_points = p->num_points;
    for (i = 0; i < p->count; i++) mesher__push(r, &r->pool, p->tets[i]);
    if (r->pool.count < (size_t)w->first + p->count) r->num_windows--; /* no memory */
    return 1;
}

/* The same for some tetrahedra. */
static int mesher__window_note(mesher__recovery *r, const delaunay_handle *tets, size_t count,
                               uint32_t max_points)
{
    mesher__patch patch;
    mesher__patch_set(r, &patch, tets, count);
    return mesher__patch_note(r, &patch, max_points);
}

/* Chooses the vertex that is opposite the most facets of the patch, preferably one that the patch
 * has already, and adds all neighbours that have this vertex. Returns 0 if there is none. */
static int mesher__patch_grow(const mesher__recovery *r, mesher__patch *p)
{
    enum { MESHER__MAX_APICES = 256 };
    uint32_t apex[MESHER__MAX_APICES], votes[MESHER__MAX_APICES];
    uint32_t n = 0, best = 0, i, j, k, count = p->count;
    if (p->full) return 0;
    for (i = 0; i < count; i++)
        for (k = 0; k < 4; k++) {
            delaunay_handle f = r->mesh->tets[p->tets[i]].n[k];
            uint32_t v;
            if (!f || mesher__patch_has(p, f / 4)) continue;
            v = r->mesh->tets[f / 4].v[f % 4];
            if (v == DELAUNAY_GHOST) continue;
            for (j = 0; j < n && apex[j] != v; j++) {}
            if (j == n) {
                if (n == MESHER__MAX_APICES) continue;
                apex[n] = v;
                votes[n++] = mesher__patch_has_point(p, v) ? 1u << 16 : 0;
            }
            votes[j]++;
        }
    if (n == 0) return 0;
    for (j = 1; j < n; j++)
        if (votes[j] > votes[best] || (votes[j] == votes[best] && apex[j] < apex[best])) best = j;
    for (i = 0; i < count; i++)
        for (k = 0; k < 4; k++) {
            delaunay_handle f = r->mesh->tets[p->tets[i]].n[k];
            if (f && delaunay_local_index(&r->mesh->tets[f / 4], apex[best]) >= 0)
                mesher__patch_add(r, p, f / 4);
        }
    return p->count > count && !p->full;
}

/* Puts the star of a mesh edge into r->star. Returns its size, 0 if that is too large. */
static size_t mesher__small_star(mesher__recovery *r, delaunay_handle t, uint32_t a, uint32_t b,
                                 uint32_t max_points)
{
    mesher__note_failure(r, delaunay_edge_star(r->mesh, r->worker, t, a, b, &r->star));
    return r->status == MESHER_OK && r->star.count + 2 <= max_points ? r->star.count : 0;
}

/* Makes a window of a patch, and others as the patch grows by up to growth vertices. */
static void mesher__patch_note_grown(mesher__recovery *r, mesher__patch *p, int growth,
                                     uint32_t max_points)
{
    while (mesher__patch_note(r, p, max_points) && growth-- > 0 && mesher__patch_grow(r, p)) {}
}

/* Windows that unite a star with the star of each edge of its tetrahedra. */
static void mesher__double_stars(mesher__recovery *r, const mesher__patch *star,
                                 uint32_t max_points)
{
    mesher__patch patch;
    uint32_t q;
    int j;
    if (star->full || star->count > 24) return;
    for (q = 0; q < star->count; q++)
        for (j = 0; j < 6; j++) {
            const uint8_t *o = delaunay_edge_order(j);
            const uint32_t *v = r->mesh->tets[star->tets[q]].v;
            if (v[3] == DELAUNAY_GHOST ||
                !mesher__small_star(r, star->tets[q], v[o[0]], v[o[1]], max_points))
                continue;
            mesher__patch_copy(&patch, star);
            mesher__patch_union(r, &patch, r->star.items, r->star.count);
            mesher__patch_note(r, &patch, max_points);
        }
}

/* Windows around one edge of the mesh near the pipe: its star, alone and with the whole pipe; from
 * level 2 on also with single crossings, and (not at level 5) with the stars of edges beside it.
 * crossed: the edge is one of a crossed face; others have no star alone, and no union of stars. */
static void mesher__windows_at_edge(mesher__recovery *r, delaunay_handle t, uint32_t a, uint32_t b,
                                    int crossed, int pipe_fits, int level, uint32_t max_points)
{
    const mesher__pipe *p = &r->pipe;
    mesher__patch star, patch;
    uint32_t q;
    if (!mesher__small_star(r, t, a, b, max_points)) return;
    mesher__patch_set(r, &star, r->star.items, r->star.count);
    if (crossed) mesher__patch_note(r, &star, max_points);
    if (pipe_fits) {
        mesher__patch_copy(&patch, &star);
        mesher__patch_union(r, &patch, p->tets, p->num_tets);
        mesher__patch_note(r, &patch, max_points);
    }
    if (level < 2) return;
    for (q = 0; q < p->num_crossings; q++) {
        const delaunay_handle *pair = p->crossings[q].tets;
        if (!mesher__patch_has(&star, pair[0]) && !mesher__patch_has(&star, pair[1])) continue;
        mesher__patch_copy(&patch, &star);
        mesher__patch_union(r, &patch, pair, 2);
        mesher__patch_note(r, &patch, max_points);
    }
    if (crossed && level < 5) mesher__double_stars(r, &star, max_points);
}

/* Windows of runs of up to 14 consecutive crossings; at level 4 also grown. */
static void mesher__windows_of_runs(mesher__recovery *r, int level, uint32_t max_points)
{
    const mesher__pipe *p = &r->pipe;
    mesher__patch patch, grown;
    uint32_t i, j;
    for (i = 0; i < p->num_crossings; i++) {
        mesher__patch_set(r, &patch, p->crossings[i].tets, 2);
        for (j = i; j < p->num_crossings && j < i + 14; j++) {
            mesher__patch_union(r, &patch, p->crossings[j].tets, 2);
            if (!mesher__patch_note(r, &patch, max_points)) break;
            if (level != 4) continue;
            mesher__patch_copy(&grown, &patch);
            mesher__patch_note_grown(r, &grown, 4, max_points);
        }
    }
}

/* Windows around a missing edge, from its pipe. Higher levels have more kinds of windows; but level
 * 5 has only the kinds of level 2, without those that unite two stars. */
static void mesher__windows_of_edge(mesher__recovery *r, int level, uint32_t max_points)
{
    const mesher__pipe *p = &r->pipe;
    mesher__patch patch;
    uint32_t i;
    int j, pipe_fits;
    mesher__windows_clear(r);
    for (i = 0; i < p->num_crossings; i++)
        mesher__window_note(r, p->crossings[i].tets, 2, max_points);
    pipe_fits = mesher__window_note(r, p->tets, p->num_tets, max_points);
    if (level >= 2 && p->num_crossings > 2) mesher__windows_of_runs(r, level, max_points);
    mesher__set_clear(&r->seen_edges);
    for (i = 0; i < p->num_crossings && r->status == MESHER_OK; i++) {
        delaunay_handle t = p->crossings[i].tets[0];
        const uint8_t *o = delaunay_facet_order(p->crossings[i].facet);
        for (j = 0; j < 3; j++) {
            uint32_t a = r->mesh->tets[t].v[o[j]], b = r->mesh->tets[t].v[o[(j + 1) % 3]];
            if (mesher__add(r, &r->seen_edges, mesher__pair(a, b)))
                mesher__windows_at_edge(r, t, a, b, 1, pipe_fits, level, max_points);
        }
    }
    for (i = 0; level >= 2 && i < p->num_tets && r->status == MESHER_OK; i++)
        for (j = 0; j < 6; j++) {
            const uint8_t *o = delaunay_edge_order(j);
            uint32_t a = r->mesh->tets[p->tets[i]].v[o[0]], b = r->mesh->tets[p->tets[i]].v[o[1]];
            if (mesher__add(r, &r->seen_edges, mesher__pair(a, b)))
                mesher__windows_at_edge(r, p->tets[i], a, b, 0, pipe_fits, level, max_points);
        }
    if (level == 3) {
        mesher__patch_set(r, &patch, p->tets, p->num_tets);
        if (pipe_fits) mesher__patch_note_grown(r, &patch, 12, max_points);
        for (i = 0; i < p->num_crossings; i++) {
            mesher__patch_set(r, &patch, p->crossings[i].tets, 2);
            mesher__patch_note_grown(r, &patch, 10, max_points);
        }
    }
    mesher__windows_sort(r);
}

/* Windows around a missing facet, from its pipe. Below level 0 only the stars of the edges that
 * pierce it, which are enough nearly always. */
static void mesher__windows_of_facet(mesher__recovery *r, int level, uint32_t max_points)
{
    const mesher__pipe *p = &r->pipe;
    mesher__patch star, patch;
    uint32_t i;
    mesher__windows_clear(r);
    if (level >= 0) {
        mesher__patch_set(r, &patch, p->tets, p->num_tets);
        mesher__patch_note_grown(r, &patch, 6 + 6 * level, max_points);
    }
    for (i = 0; i < p->num_edges && r->status == MESHER_OK; i++) {
        if (!mesher__small_star(r, p->edge_tets[i], p->edges[i][0], p->edges[i][1], max_points))
            continue;
        mesher__patch_set(r, &star, r->star.items, r->star.count);
        if (level < 0) {
            mesher__patch_note(r, &star, max_points);
            continue;
        }
        mesher__patch_copy(&patch, &star);
        mesher__patch_note_grown(r, &patch, 4 + 4 * level, max_points);
        mesher__double_stars(r, &star, max_points);
    }
    mesher__windows_sort(r);
}

/* -- one search */

typedef struct mesher__effort {
    uint32_t max_points, max_nodes;
    int      level, passes;
} mesher__effort;

/* Puts the tetrahedra that the search over r->window found into r->commit, from number first on.
 * Returns how many. */
static uint32_t mesher__take_search(mesher__recovery *r, uint32_t first)
{
    const delaunay_search *s = &r->search;
    uint32_t i, k;
    for (i = 0; i < s->num_tets; i++)
        for (k = 0; k < 4; k++) r->commit[4 * (first + i) + k] = r->window.vertices[s->tets[i][k]];
    return s->num_tets;
}

/* Searches r->window for any filling. */
static int mesher__search_any(mesher__recovery *r, uint32_t max_nodes)
{
    delaunay_search *s = &r->search;
    int found;
    memset(s, 0, offsetof(delaunay_search, tets));
    s->objective = DELAUNAY_ANY;
    s->max_nodes = max_nodes;
    found = delaunay_reconnect(r->mesh, r->worker, &r->window, s);
    r->nodes += s->nodes;
    return found;
}

/* Searches one window for a filling with fewer crossings of the target, and commits it. */
static int mesher__try_window(mesher__recovery *r, const mesher__window *w,
                              delaunay_objective objective, const uint32_t *target,
                              const mesher__effort *effort, int keep_facets)
{
    const delaunay_handle *tets = r->pool.items + w->first;
    uint64_t kind = (uint64_t)target[2] * 64 + (uint64_t)objective * 2 + (uint64_t)keep_facets;
    uint64_t key = w->signature +
                   mesher__mix(((uint64_t)target[0] << 32 | target[1]) + mesher__mix(kind)) +
                   effort->max_nodes;
    delaunay_search *s = &r->search;
    uint32_t crossings;
    int found;
    if (mesher__set_has(&r->failed, key)) return 0;
    if (!delaunay_window_set(&r->window, r->mesh, tets, w->num_tets, effort->max_points, 1,
                             keep_facets))
        return 0;
    crossings = delaunay_window_crossings(r->mesh, &r->window, objective, target);
    if (crossings == 0) return 0;
    memset(s, 0, offsetof(delaunay_search, tets));
    s->objective = objective;
    s->bound = crossings;
    memcpy(s->target, target, sizeof s->target);
    s->max_nodes = effort->max_nodes;
    r->searches++;
    r->work += 50;
    found = delaunay_reconnect(r->mesh, r->worker, &r->window, s);
    r->nodes += s->nodes;
    r->work += 3 * (uint64_t)s->nodes;
    if (!found) {
        mesher__add(r, &r->failed, key);
        return 0;
    }
    return mesher__commit(r, r->window.tets, r->window.num_tets, r->commit,
                          mesher__take_search(r, 0));
}

/* Does the mesh still have the tetrahedra that the window was made of? */
static int mesher__window_stands(const mesher__recovery *r, const mesher__window *w)
{
    const delaunay_handle *tets = r->pool.items + w->first;
    uint64_t signature = 0;
    uint32_t i;
    for (i = 0; i < w->num_tets; i++) {
        if (delaunay_is_deleted(r->mesh, tets[i])) return 0;
        signature += mesher__tet_signature(&r->mesh->tets[tets[i]]);
    }
    return signature == w->signature;
}

/* Searches the windows in order until the target is in the mesh. Those that a commit changed are
 * skipped. Returns the number of commits. */
static uint32_t mesher__try_windows(mesher__recovery *r, delaunay_objective objective,
                                    const uint32_t *target, const mesher__effort *effort,
                                    const uint8_t *present, int keep_facets)
{
    uint32_t i, done = 0;
    for (i = 0; i < r->num_windows && !*present && !mesher__stopped(r); i++) {
        const mesher__window *w = &r->windows[(uint32_t)r->window_order[i]];
        if (done && !mesher__window_stands(r, w)) continue;
        done += (uint32_t)mesher__try_window(r, w, objective, target, effort, keep_facets);
    }
    return done;
}

/* -- defects met on the way */

static uint32_t mesher__id(const mesher__recovery *r, uint32_t v) { return r->mesh->vertex_id[v]; }

/* Reports vertex v, which lies on a missing edge (facet: NULL) that is from source. It is none of
 * those in no facet or line: mesher__place_isolated has left these out. */
static void mesher__report_vertex(mesher__recovery *r, uint32_t v, uint32_t source,
                                  const uint32_t *edge)
{
    uint32_t id = mesher__id(r, v), e;
    if (id >= r->domain->first_corner) return; /* a Steiner point, which is removed later */
    for (e = 0; r->edges[2 * (size_t)e] != v && r->edges[2 * (size_t)e + 1] != v; e++) {}
    r->defects++;
    mesher_report_add(r->report, MESHER_DEFECT_T_JUNCTION, mesher__edge_source(r, e), source, id,
                      edge ? mesher__id(r, edge[0]) : DELAUNAY_NO_ID,
                      edge ? mesher__id(r, edge[1]) : DELAUNAY_NO_ID, mesher__x(r, v));
}

/* The source of the constrained edge between two vertices; NO_ID: there is none. */
static uint32_t mesher__source_between(const mesher__recovery *r, uint32_t a, uint32_t b)
{
    uint32_t e = mesher__edge_index(r, a, b);
    return e == MESHER__ABSENT ? DELAUNAY_NO_ID : mesher__edge_source(r, e);
}

/* Reports that what is missing, from source, and what is from other intersect: edge ab is one of
 * them. The place is that where ab meets the plane of a face, about. */
static void mesher__report_crossing(mesher__recovery *r, uint32_t source, uint32_t other,
                                    const uint32_t *ab, const uint32_t *face)
{
    const double *a = mesher__x(r, ab[0]), *b = mesher__x(r, ab[1]);
    double where = mesher__where(r, ab[0], ab[1], face), xyz[3];
    int k;
    for (k = 0; k < 3; k++) xyz[k] = a[k] + where * (b[k] - a[k]);
    r->defects++;
    mesher_report_add(r->report, MESHER_DEFECT_INTERSECTION, source, other, mesher__id(r, ab[0]),
                      mesher__id(r, ab[1]), DELAUNAY_NO_ID, xyz);
}

/* Reports what the pipe of a missing edge proves about the surface. Returns 1 if a vertex or a
 * constraint is in the way, so that the edge cannot come in. */
static int mesher__report_edge(mesher__recovery *r, uint32_t e)
{
    const mesher__pipe *p = &r->pipe;
    const uint32_t *v = r->edges + 2 * (size_t)e, *w = p->blocker;
    uint32_t source = mesher__edge_source(r, e), other, corner[3];
    if (!p->vertex && !p->blocked) return 0;
    if (r->num_splits) return 1; /* pieces are rounded: they prove nothing */
    if (p->vertex) {
        mesher__report_vertex(r, p->vertex, source, v);
    } else if (p->blocked == 3) {
        other = mesher__facet_index(r, w[0], w[1], w[2]);
        other = other == MESHER__ABSENT ? DELAUNAY_NO_ID : mesher__facet_source(r, other);
        mesher__report_crossing(r, source, other, v, w);
    } else {
        corner[0] = w[0];
        corner[1] = w[1];
        corner[2] = r->mesh->vertex_of[r->domain->first_corner];
        mesher__report_crossing(r, source, mesher__source_between(r, w[0], w[1]), v, corner);
    }
    return 1;
}

/* The same for a missing facet. */
static int mesher__report_facet(mesher__recovery *r, uint32_t f)
{
    const mesher__pipe *p = &r->pipe;
    const uint32_t *ab = p->blocker;
    uint32_t source = mesher__facet_source(r, f);
    if (!p->vertex && !p->blocked) return 0;
    if (r->num_splits) return 1; /* pieces are rounded: they prove nothing */
    if (p->vertex)
        mesher__report_vertex(r, p->vertex, source, NULL);
    else
        mesher__report_crossing(r, source, mesher__source_between(r, ab[0], ab[1]), ab,
                                r->facets + 3 * (size_t)f);
    return 1;
}

/* ---- >>flips  of what a missing edge crosses ----------------------------------------------
 * All in a copy of a few tetrahedra around the missing edge. What the edge crosses is flipped away
 * there; edges that prevent a flip are removed before it, and so on, recursively [Si 2015, 4.2]. An
 * edge is removed by the triangulation of its link that the missing edge crosses least [Shewchuk
 * 2002]. Only the copy is written meanwhile; the mesh is updated once, at the end. */
#  define MESHER__NEVER UINT16_MAX

static int mesher__flip_orient(const mesher__flips *f, uint32_t a, uint32_t b, uint32_t c,
                               uint32_t d)
{
    const delaunay_vertex *x = f->mesh->vertices;
    return delaunay_orient3d(x[a].x, x[b].x, x[c].x, x[d].x);
}

/* Sets two axes across the missing edge ab, right-handed with it, each divided by its length. */
static void mesher__views_set(mesher__flips *f)
{
    const double *a = f->mesh->vertices[f->a].x, *b = f->mesh->vertices[f->b].x;
    double (*e)[3] = f->across, d[3], length2 = 0, scale;
    int i, j, k;
    for (i = 0; i < 3; i++) {
        d[i] = b[i] - a[i];
        length2 += d[i] * d[i];
    }
    i = fabs(d[0]) < fabs(d[1]) ? 0 : 1; /* the axis least along it */
    if (fabs(d[2]) < fabs(d[i])) i = 2;
    j = (i + 1) % 3;
    k = (i + 2) % 3;
    scale = 1 / sqrt(length2 * (d[j] * d[j] + d[k] * d[k]));
    if (!(length2 > 1e-150 && length2 < 1e150)) scale = length2 = 0; /* views decide nothing */
    e[0][i] = 0;
    e[0][j] = d[k] * scale;
    e[0][k] = -d[j] * scale;
    scale = f->per_length = length2 > 0 ? 1 / sqrt(length2) : 0;
    for (i = 0; i < 3; i++) {
        j = (i + 1) % 3;
        k = (i + 2) % 3;
        e[1][i] = (d[j] * e[0][k] - d[k] * e[0][j]) * scale;
    }
}

static inline const mesher__view *mesher__view_of(mesher__flips *f, uint32_t v)
{
    mesher__view *view = &f->views[v & (MESHER__VIEWS - 1)];
    uint64_t key = (uint64_t)f->epoch << 32 | v;
    const double *a = f->mesh->vertices[f->a].x, *x = f->mesh->vertices[v].x;
    double d[3];
    if (view->key == key) return view;
    d[0] = x[0] - a[0];
    d[1] = x[1] - a[1];
    d[2] = x[2] - a[2];
    view->key = key;
    view->x = f->across[0][0] * d[0] + f->across[0][1] * d[1] + f->across[0][2] * d[2];
    view->y = f->across[1][0] * d[0] + f->across[1][1] * d[1] + f->across[1][2] * d[2];
    view->distant = (fabs(d[0]) + fabs(d[1]) + fabs(d[2])) * f->per_length;
    return view;
}

/* mesher__turn, but 0 where the views do not suffice. */
static int mesher__seems_turn(const mesher__view *p, const mesher__view *q)
{
    double turn = p->x * q->y - p->y * q->x, bound = p->distant * q->distant * 1e-14 + 1e-290;
    return (turn > bound) - (turn < -bound);
}

/* Which way pq turns about the missing edge ab: the sign of ab . (ap x aq), by the views where they
 * suffice. Bound of their error, in units of 2^-53 and lengths of ab: differences are off by 1
 * each, the axes by 8, sums of three products by 3, so a view by 12 times its distance, and the
 * last difference by about 26 times the product of both distances. The bound is 90 times that
 * product; what underflows or overflows is left to the exact predicate, too. */
static int mesher__turn(mesher__flips *f, uint32_t p, uint32_t q)
{
    const mesher__view view = *mesher__view_of(f, p); /* that of q may take its slot */
    int sign = mesher__seems_turn(&view, mesher__view_of(f, q));
    return sign ? sign : mesher__flip_orient(f, f->a, f->b, p, q);
}

/* Starts with an empty copy, for missing edge ab. */
static void mesher__flips_clear(mesher__flips *f, const delaunay_mesh *mesh, uint32_t a, uint32_t b)
{
    f->mesh = mesh;
    f->a = a;
    f->b = b;
    f->num_cells = 1;
    f->num_free = f->num_log = f->num_made = 0;
    f->full = 0;
    f->apart = 0;
    f->ring_filled = MESHER__RING_USUAL;
    f->start = 0;
    memset(f->changed, 0, sizeof f->changed);
    mesher__views_set(f);
    if (++f->epoch < 1u << (32 - MESHER__CELL_BITS) && f->epoch) return;
    memset(f->slots, 0, sizeof f->slots);
    memset(f->views, 0, sizeof f->views);
    memset(f->rings, 0, sizeof f->rings);
    f->epoch = 1;
}

static void mesher__cells_link(mesher__flips *f, delaunay_handle g, delaunay_handle h)
{
    mesher__copy *c = &f->cells[g / 4], *d = &f->cells[h / 4];
    c->n[g % 4] = h;
    d->n[h % 4] = g;
    c->linked = (uint8_t)(c->linked | 1u << g % 4);
    d->linked = (uint8_t)(d->linked | 1u << h % 4);
}

/* The slot in the hash table that has the copy of a tetrahedron, or would have it. Tetrahedra with
 * numbers near each other, which are mostly near each other in space, have their slots so, too. */
static uint32_t mesher__cell_slot(const mesher__flips *f, delaunay_handle t)
{
    uint32_t j = (uint32_t)t & (MESHER__CELL_SLOTS - 1), slot;
    for (;; j = (j + 1) & (MESHER__CELL_SLOTS - 1)) {
        slot = f->slots[j];
        if (slot >> MESHER__CELL_BITS != f->epoch) return j;
        if (f->cells[slot & (MESHER__CELLS - 1)].from == t) return j;
    }
}

/* Asks for what a cell is copied from, which mostly is needed next. */
static inline void mesher__cell_prefetch(const mesher__flips *f, delaunay_handle t)
{
    MESHER__PREFETCH(f->mesh->tets + t);
    MESHER__PREFETCH(f->mesh->flags + t);
}

/* The cell that is the copy of a tetrahedron, which is made if need be; 0: no room. */
static uint32_t mesher__cell_of(mesher__flips *f, delaunay_handle t)
{
    uint32_t j = mesher__cell_slot(f, t), number = f->num_cells, k;
    mesher__copy *c = &f->cells[number];
    if (f->slots[j] >> MESHER__CELL_BITS == f->epoch) return f->slots[j] & (MESHER__CELLS - 1);
    if (number == MESHER__CELLS) {
        f->full = 1;
        return 0;
    }
    f->num_cells++;
    f->slots[j] = f->epoch << MESHER__CELL_BITS | number;
    memcpy(c->v, f->mesh->tets[t].v, sizeof c->v);
    memcpy(c->n, f->mesh->tets[t].n, sizeof c->n);
    c->from = t;
    c->flags = f->mesh->flags[t];
    c->linked = c->gone = c->rings = 0;
    for (k = 0; k < 4; k++) {
        mesher__cell_prefetch(f, c->n[k] / 4);
        if (c->v[k] != DELAUNAY_GHOST) MESHER__PREFETCH(f->mesh->vertices + c->v[k]);
    }
    return number;
}

/* The facet beyond facet k of a cell, as 4 * cell + facet; 0: there is none, or no room. Copies are
 * linked when one is entered from the other. A flip links what it makes to all cells around it, so
 * beyond a facet without a link nothing has been flipped. */
static delaunay_handle mesher__beyond(mesher__flips *f, uint32_t cell, uint32_t k)
{
    mesher__copy *c = &f->cells[cell];
    delaunay_handle h = c->n[k];
    uint32_t other;
    if (c->linked >> k & 1) return h;
    other = h ? mesher__cell_of(f, h / 4) : 0;
    if (!other) return 0;
    mesher__cells_link(f, 4 * (delaunay_handle)cell + k, 4 * (delaunay_handle)other + h % 4);
    return c->n[k];
}

/* The place of a vertex in a cell; -1: it is not there. No branch depends on the place. */
static int mesher__cell_index(const mesher__copy *c, uint32_t v)
{
    int i = (c->v[1] == v) + 2 * (c->v[2] == v) + 3 * (c->v[3] == v);
    return c->v[i] == v ? i : -1;
}

/* The same for a vertex that is there. */
static uint32_t mesher__cell_place(const mesher__copy *c, uint32_t v)
{
    return (uint32_t)((c->v[1] == v) + 2 * (c->v[2] == v) + 3 * (c->v[3] == v));
}

/* Is the edge between two places of a cell constrained? */
static uint8_t mesher__edge_bit(const mesher__copy *c, uint32_t i, uint32_t j)
{
    return (c->flags & DELAUNAY_EDGE_BIT(delaunay_edge_between((int)i, (int)j))) != 0;
}

/* The same for two vertices of a cell. */
static unsigned mesher__cell_edge(const mesher__copy *c, uint32_t a, uint32_t b)
{
    return mesher__edge_bit(c, mesher__cell_place(c, a), mesher__cell_place(c, b));
}

/* A cell that has vertices a and b, which may be equal; 0: there is none. */
static uint32_t mesher__cell_with(const mesher__flips *f, uint32_t a, uint32_t b)
{
    uint32_t i;
    for (i = f->num_cells; i-- > 1;) {
        const mesher__copy *c = &f->cells[i];
        int has_a = (c->v[0] == a) | (c->v[1] == a) | (c->v[2] == a) | (c->v[3] == a);
        int has_b = (c->v[0] == b) | (c->v[1] == b) | (c->v[2] == b) | (c->v[3] == b);
        if (has_a & has_b & !c->gone) return i;
    }
    return 0;
}

/* Is there room for a flip: for its new cells, and in the log? */
static int mesher__flip_room(mesher__flips *f, uint32_t gone, uint32_t made)
{
    if (f->num_cells - 1 + made <= MESHER__CELLS - 1 + f->num_free &&
        f->num_log + gone + made + 2 <= MESHER__FLIP_LOG)
        return 1;
    f->full = 1;
    return 0;
}

static void mesher__log_cell(mesher__flips *f, uint32_t cell)
{
    f->log[f->num_log++] = cell;
    f->changed[cell / 32] |= 1u << cell % 32;
}

static uint32_t mesher__new_cell(mesher__flips *f, uint32_t a, uint32_t b, uint32_t c, uint32_t d,
                                 unsigned flags)
{
    uint32_t i = f->num_free ? f->free_cells[--f->num_free] : f->num_cells++;
    mesher__copy *cell = &f->cells[i];
    cell->v[0] = a;
    cell->v[1] = b;
    cell->v[2] = c;
    cell->v[3] = d;
    cell->from = 0;
    cell->flags = (uint16_t)flags;
    cell->linked = cell->gone = cell->rings = 0;
    mesher__log_cell(f, i);
    return i;
}

/* Notes an edge that a flip makes. A flip of two tetrahedra to three makes one, the removal of an
 * edge with n tetrahedra n - 3: fewer than a third of the numbers that it writes to the log. */
static void mesher__edge_made(mesher__flips *f, uint32_t a, uint32_t b)
{
    f->made[f->num_made][0] = a;
    f->made[f->num_made++][1] = b;
}

static void mesher__cell_goes(mesher__flips *f, uint32_t cell)
{
    f->cells[cell].gone = 1;
    mesher__log_cell(f, cell);
}

static void mesher__flip_done(mesher__flips *f, uint32_t gone, uint32_t made)
{
    f->log[f->num_log++] = gone;
    f->log[f->num_log++] = made;
}

/* Takes flips back, the last one first, until the log has its former length. */
static void mesher__flips_undo(mesher__flips *f, uint32_t length)
{
    while (f->num_log > length) {
        uint32_t made = f->log[f->num_log - 1], gone = f->log[f->num_log - 2], i, k;
        f->num_log -= 2;
        f->num_made -= made == 3 ? 1 : gone - 3; /* 3: made from two */
        for (i = 0; i < made; i++) {
            uint32_t cell = f->log[--f->num_log];
            f->cells[cell].gone = 1;
            f->free_cells[f->num_free++] = cell;
        }
        for (i = 0; i < gone; i++) {
            uint32_t cell = f->log[--f->num_log];
            f->cells[cell].gone = 0;
            for (k = 0; k < 4; k++)
                if (f->cells[cell].linked >> k & 1)
                    mesher__cells_link(f, 4 * cell + k, f->cells[cell].n[k]);
        }
    }
}

/* The ring of edge pq of a cell. 0: pq cannot be removed, as it is a constraint, has too many
 * tetrahedra, or is on the hull. */
static int mesher__ring_of(mesher__flips *f, uint32_t cell, uint32_t p, uint32_t q,
                           mesher__ring *ring)
{
    const mesher__copy *c = &f->cells[cell];
    const uint8_t *o = delaunay_facet_order((int)mesher__cell_place(c, p));
    uint32_t k = (uint32_t)((c->v[o[1]] == q) + 2 * (c->v[o[2]] == q)), next, out;
    delaunay_handle h;
    if (mesher__cell_edge(c, p, q)) return 0;
    ring->p = p;
    ring->q = q;
    ring->r[0] = c->v[o[(k + 1) % 3]];
    ring->cells[0] = cell;
    next = c->v[o[(k + 2) % 3]];
    out = ring->r[0];
    for (ring->n = 1; next != ring->r[0]; ring->n++) {
        if (ring->n == MESHER__RING) return 0;
        h = mesher__beyond(f, cell, mesher__cell_place(&f->cells[cell], out));
        cell = (uint32_t)(h / 4);
        if (!h || f->cells[cell].v[3] == DELAUNAY_GHOST) return 0;
        out = next;
        ring->r[ring->n] = out;
        ring->cells[ring->n] = cell;
        next = f->cells[cell].v[h % 4];
    }
    return 1;
}

/* The vectors from p and q to the vertices of a ring, side by side, and the squares of their
 * lengths, infinite where the filter of an orientation would not be certain. */
typedef struct mesher__spokes {
    double at[MESHER__RING_FILLED][3][2], length2[MESHER__RING_FILLED][2];
} mesher__spokes;

static void mesher__spokes_set(const mesher__flips *f, const mesher__ring *g, mesher__spokes *s)
{
    const delaunay_vertex *x = f->mesh->vertices;
    const double *p = x[g->p].x, *q = x[g->q].x;
    uint32_t i, k;
    for (i = 0; i < g->n; i++) {
        const double *r = x[g->r[i]].x;
        double(*d)[2] = s->at[i], *length2 = s->length2[i];
        for (k = 0; k < 3; k++) {
            d[k][0] = r[k] - p[k];
            d[k][1] = r[k] - q[k];
        }
        for (k = 0; k < 2; k++) {
            length2[k] = d[0][k] * d[0][k] + d[1][k] * d[1][k] + d[2][k] * d[2][k];
            length2[k] = length2[k] > 1e-90 && length2[k] < 1e100 ? length2[k] : HUGE_VAL;
        }
    }
}

/* Is r[i] r[k] r[j] strictly between p and q? With the filter of delaunay_orient3d; -1: it is not
 * certain of that, and the exact predicate is needed. */
static int mesher__seems_between(const mesher__spokes *s, uint32_t i, uint32_t k, uint32_t j)
{
    const double(*b)[2] = s->at[i], (*c)[2] = s->at[k], (*d)[2] = s->at[j];
    double det[2], bound[2];
    int n, sure_p, sure_q;
    for (n = 0; n < 2; n++) {
        det[n] = b[0][n] * (c[1][n] * d[2][n] - c[2][n] * d[1][n]) +
                 b[1][n] * (c[2][n] * d[0][n] - c[0][n] * d[2][n]) +
                 b[2][n] * (c[0][n] * d[1][n] - c[1][n] * d[0][n]);
        bound[n] = 2e-30 * s->length2[i][n] * s->length2[k][n] * s->length2[j][n];
    }
    sure_p = det[0] * det[0] > bound[0];
    sure_q = det[1] * det[1] > bound[1];
    if (sure_p & sure_q) return (det[0] > 0) & (det[1] < 0);
    return (sure_p & (det[0] < 0)) | (sure_q & (det[1] > 0)) ? 0 : -1;
}

static int mesher__is_between(const mesher__flips *f, const mesher__ring *g, uint32_t i, uint32_t k,
                              uint32_t j)
{
    return mesher__flip_orient(f, g->p, g->r[i], g->r[k], g->r[j]) > 0 &&
           mesher__flip_orient(f, g->q, g->r[i], g->r[k], g->r[j]) < 0;
}

/* Can a ring of more than three vertices be triangulated, if these are the vertices at which a
 * triangle cuts off a corner? Two of them, not neighbors, have one in every triangulation. */
static int mesher__enough_ears(unsigned ears, uint32_t n)
{
    unsigned low = ears & (~ears + 1), around = low << 1 | low >> 1 | low;
    around |= (low & 1) << (n - 1) | low >> (n - 1);
    return (ears & ~around) != 0 || (ears & (around ^ low)) == (around ^ low);
}

/* The vertices of a ring at which a triangle cuts off a corner, as bits; 0: too few of them for a
 * triangulation, or none at vertex number ear, if that is one of the ring. */
static unsigned mesher__ring_ears(const mesher__flips *f, const mesher__ring *g,
                                  const mesher__spokes *s, uint32_t ear)
{
    uint32_t i, n = g->n;
    unsigned ears = 0, unsure = 0, wanted = ear < n ? 1u << ear : 0;
    for (i = 0; i < n; i++) {
        int between = mesher__seems_between(s, i ? i - 1 : n - 1, i, i + 1 < n ? i + 1 : 0);
        ears |= (unsigned)(between != 0) << i;
        unsure |= (unsigned)(between < 0) << i;
    }
    if (wanted & ~ears || !mesher__enough_ears(ears, n)) return 0;
    if (!unsure) return ears;
    for (i = 0; i < n; i++)
        if (unsure >> i & 1 &&
            !mesher__is_between(f, g, i ? i - 1 : n - 1, i, i + 1 < n ? i + 1 : 0))
            ears &= ~(1u << i);
    return wanted & ~ears || !mesher__enough_ears(ears, n) ? 0 : ears;
}

/* What may be the triangulations of a ring, by its chords ij, i < j: the possible apexes of the
 * triangle at the chord, as bits, and the number of ways to fill what is between chord and ring. */
typedef struct mesher__chords {
    uint16_t apexes[MESHER__RING_FILLED][MESHER__RING_FILLED];
    uint32_t ways[MESHER__RING_FILLED][MESHER__RING_FILLED];
} mesher__chords;

/* Finds the possible apexes at chord ij. apexes: those to which both ends of the chord have chords,
 * or are neighbors, as bits. */
static void mesher__chord_set(mesher__flips *f, const mesher__ring *g, const mesher__spokes *s,
                              unsigned ears, uint32_t i, uint32_t j, unsigned apexes,
                              mesher__chords *c)
{
    unsigned left = apexes, ways = 0, n = g->n;
    for (; left; left &= left - 1) {
        uint32_t k = mesher__lowest_bit(left);
        int between;
        if (j == i + 2) between = ears >> k & 1;
        else if (j - i == n - 1 && k == 1) between = ears & 1;
        else if (j - i == n - 1 && k == n - 2) between = ears >> j & 1;
        else {
            f->work += 2;
            between = mesher__seems_between(s, i, k, j);
            if (between < 0) between = mesher__is_between(f, g, i, k, j);
        }
        apexes &= ~((unsigned)!between << k);
        ways += between ? c->ways[i][k] * c->ways[k][j] : 0;
    }
    c->ways[i][j] = ways;
    c->apexes[i][j] = (uint16_t)apexes;
}

/* The same for a ring of four: it has two chords, each with the ears beside it. */
static int mesher__list_two_chords(unsigned ears, unsigned no_chord, mesher__chords *c)
{
    unsigned even = (ears & 10) == 10 && !(no_chord & 5), odd = (ears & 5) == 5 && !(no_chord & 10);
    c->apexes[0][2] = 1 << 1;
    c->apexes[1][3] = 1 << 2;
    c->apexes[0][3] = (uint16_t)(odd << 1 | even << 2);
    return (int)(odd + even);
}

/* Lists all triangulations of a ring, with no chord at vertex number ear. Returns their number. */
static int mesher__list_chords(mesher__flips *f, const mesher__ring *g, uint32_t ear,
                               mesher__chords *c)
{
    mesher__spokes s;
    uint32_t i, j, width, n = g->n;
    unsigned ears, up[MESHER__RING_FILLED], down[MESHER__RING_FILLED];
    mesher__spokes_set(f, g, &s);
    f->work += 2 * n;
    ears = mesher__ring_ears(f, g, &s, ear);
    if (!ears) return 0;
    if (n == 4) return mesher__list_two_chords(ears, 1u << ear, c);
    for (i = 0; i < n; i++) {
        up[i] = 1u << (i + 1);
        down[i] = i ? 1u << (i - 1) : 0;
        if (i) c->ways[i - 1][i] = 1;
    }
    for (width = 2; width < n; width++)
        for (i = 0; i + width < n; i++) {
            unsigned apexes = up[i] & down[i + width];
            j = i + width;
            if (width + 1 < n && (i == ear || j == ear)) continue;
            if (!apexes) continue;
            mesher__chord_set(f, g, &s, ears, i, j, apexes, c);
            up[i] |= (unsigned)(c->ways[i][j] > 0) << j;
            down[j] |= (unsigned)(c->ways[i][j] > 0) << i;
        }
    return up[0] >> (n - 1) & 1 ? (int)c->ways[0][n - 1] : 0;
}

/* The views of the vertices of a ring, then of p and q. */
typedef struct mesher__sights {
    uint32_t     v[MESHER__RING_FILLED + 2];
    mesher__view view[MESHER__RING_FILLED + 2];
} mesher__sights;

static void mesher__sights_set(mesher__flips *f, const mesher__ring *g, mesher__sights *s)
{
    uint32_t i, n = g->n;
    memcpy(s->v, g->r, n * sizeof *s->v);
    s->v[n] = g->p;
    s->v[n + 1] = g->q;
    for (i = 0; i < n + 2; i++) s->view[i] = *mesher__view_of(f, s->v[i]);
}

/* Does the missing edge cross a face, or one of its edges? As delaunay_segment_crosses, but with
 * the turns first, which are fast. The face is given by the numbers of its vertices. */
static unsigned mesher__in_way(const mesher__flips *f, const mesher__sights *s, uint32_t i,
                               uint32_t j, uint32_t k)
{
    uint32_t a = f->a, b = f->b, p = s->v[i], q = s->v[j], r = s->v[k];
    int x = mesher__seems_turn(&s->view[i], &s->view[j]), side;
    int y = mesher__seems_turn(&s->view[j], &s->view[k]);
    int z = mesher__seems_turn(&s->view[k], &s->view[i]);
    if ((x * y < 0) | (x * z < 0) | (y * z < 0)) return 0;
    if ((a == p) | (a == q) | (a == r) | (b == p) | (b == q) | (b == r)) return 0;
    if (!x) x = mesher__flip_orient(f, a, b, p, q);
    if (!y) y = mesher__flip_orient(f, a, b, q, r);
    if (x * y < 0) return 0;
    if (!z) z = mesher__flip_orient(f, a, b, r, p);
    if (x * z < 0 || y * z < 0) return 0;
    side = mesher__flip_orient(f, p, q, r, a);
    return side != 0 && side * mesher__flip_orient(f, p, q, r, b) < 0;
}

/* Chooses, of all triangulations of a ring, the one whose new faces are crossed least by the
 * missing edge, by dynamic programming over the ring's chords [Klincsek 1980]. */
static void mesher__least_crossed(mesher__flips *f, const mesher__ring *g, const mesher__chords *c,
                                  uint8_t (*apex)[MESHER__RING_FILLED])
{
    uint16_t cost[MESHER__RING_FILLED][MESHER__RING_FILLED];
    uint16_t needed[MESHER__RING_FILLED]; /* of i: the chords ij of a triangulation, as bits */
    mesher__sights s;
    uint32_t i, j, k, width, n = g->n, sum;
    unsigned left;
    mesher__sights_set(f, g, &s);
    memset(needed, 0, sizeof needed);
    needed[0] = (uint16_t)(1u << (n - 1));
    for (width = n - 1; width > 2; width--)
        for (i = 0; i + width < n; i++)
            if (j = i + width, needed[i] >> j & 1)
                for (left = c->apexes[i][j]; left; left &= left - 1) {
                    k = mesher__lowest_bit(left);
                    needed[i] = (uint16_t)(needed[i] | 1u << k);
                    needed[k] = (uint16_t)(needed[k] | 1u << j);
                }
    for (i = 0; i + 1 < n; i++) cost[i][i + 1] = 0;
    for (width = 2; width < n; width++)
        for (i = 0; i + width < n; i++) {
            unsigned own = 0, known = width + 1 == n;
            j = i + width;
            if (!(needed[i] >> j & 1)) continue;
            cost[i][j] = MESHER__NEVER;
            for (left = c->apexes[i][j]; left; left &= left - 1) {
                k = mesher__lowest_bit(left);
                sum = (uint32_t)cost[i][k] + cost[k][j];
                if (sum >= cost[i][j]) continue;
                if (!known)
                    own = mesher__in_way(f, &s, n, i, j) + mesher__in_way(f, &s, n + 1, i, j);
                known = 1;
                sum += own + mesher__in_way(f, &s, i, k, j);
                if (sum >= cost[i][j]) continue;
                cost[i][j] = (uint16_t)sum;
                apex[i][j] = (uint8_t)k;
            }
        }
}

/* Chooses the first apex everywhere between chord ij and the ring: where there is only one, or if
 * nothing is missing. */
static void mesher__first_apexes(const mesher__chords *c, uint32_t i, uint32_t j,
                                 uint8_t (*apex)[MESHER__RING_FILLED])
{
    while (j > i + 1) {
        uint32_t k = mesher__lowest_bit(c->apexes[i][j]);
        apex[i][j] = (uint8_t)k;
        mesher__first_apexes(c, i, k, apex);
        i = k;
    }
}

/* The place for the triangulation of a ring, with what it depends on. *known: it is there. Attempts
 * at one missing edge often come to the same ring again. */
static mesher__ring_filled *mesher__ring_place(mesher__flips *f, const mesher__ring *g,
                                               uint32_t ear, int *known)
{
    uint32_t hash = (g->p * 5 + g->q * 3 + g->r[0]) ^ ear << 2 ^ g->r[g->n / 2] << 3, i;
    mesher__ring_filled *t = &f->rings[hash & (MESHER__RINGS - 1)];
    unsigned differ = (t->epoch ^ f->epoch) | (t->p ^ g->p) | (t->q ^ g->q) | (t->n ^ g->n);
    differ |= t->ear ^ ear;
    for (i = 0; i < g->n; i++) differ |= t->r[i] ^ g->r[i];
    *known = !differ;
    if (!differ) return t;
    t->epoch = f->epoch;
    t->p = g->p;
    t->q = g->q;
    t->ear = ear;
    t->n = g->n;
    memcpy(t->r, g->r, g->n * sizeof *t->r);
    return t;
}

/* The triangulation of the ring whose new faces are crossed least by the missing edge, and which
 * has no chord at vertex ear (0: any), into *f->ring. 0: there is none. */
static int mesher__triangulate_ring(mesher__flips *f, const mesher__ring *g, uint32_t ear)
{
    mesher__chords c;
    mesher__ring_filled *t;
    uint32_t i, n = g->n, number = MESHER__RING_FILLED;
    int known, ways;
    if (n < 3 || n > f->ring_filled) return 0;
    t = f->ring = mesher__ring_place(f, g, ear, &known);
    if (known) return t->filled;
    if (n == 3) {
        f->work += 2;
        t->apex[0][2] = 1;
        return t->filled = mesher__is_between(f, g, 0, 1, 2);
    }
    for (i = 0; i < n && ear; i++)
        if (g->r[i] == ear) number = i;
    ways = mesher__list_chords(f, g, number, &c);
    t->filled = ways > 0;
    if (ways > 1 && f->a != f->b) mesher__least_crossed(f, g, &c, t->apex);
    else if (ways) mesher__first_apexes(&c, 0, n - 1, t->apex);
    return t->filled;
}

/* What stays of a ring whose edge is removed: the facets beyond the cells, opposite q and p, and
 * the marks of the edges at p and q, of the ring's own edges, and of the outer facets. */
typedef struct mesher__ring_marks {
    delaunay_handle beyond_q[MESHER__RING_FILLED], beyond_p[MESHER__RING_FILLED];
    uint8_t at_p[MESHER__RING_FILLED], at_q[MESHER__RING_FILLED], rim[MESHER__RING_FILLED];
    uint8_t facet_q[MESHER__RING_FILLED], facet_p[MESHER__RING_FILLED];
} mesher__ring_marks;

/* Makes the two cells at chord ij, and all that are between the chord and the ring. sides: facets
 * p r[i] r[j] and q r[i] r[j], which the caller links. */
static void mesher__fill_ring(mesher__flips *f, const mesher__ring *g, const mesher__ring_marks *m,
                              uint32_t i, uint32_t j, delaunay_handle *sides)
{
    uint32_t k, c, d;
    unsigned rim_ij, rim_ik, rim_kj, flags;
    delaunay_handle below[2], above[2];
    if (j == i + 1) {
        sides[0] = m->beyond_q[i];
        sides[1] = m->beyond_p[i];
        return;
    }
    k = f->ring->apex[i][j];
    rim_ij = i == 0 && j == g->n - 1 ? m->rim[j] : 0;
    rim_ik = k == i + 1 ? m->rim[i] : 0;
    rim_kj = j == k + 1 ? m->rim[k] : 0;
    flags = DELAUNAY_EDGE_BIT(0) * m->at_p[i] | DELAUNAY_EDGE_BIT(1) * m->at_p[k] |
            DELAUNAY_EDGE_BIT(2) * m->at_p[j] | DELAUNAY_EDGE_BIT(3) * rim_ik |
            DELAUNAY_EDGE_BIT(4) * rim_ij | DELAUNAY_EDGE_BIT(5) * rim_kj;
    if (k == i + 1) flags |= DELAUNAY_FACET_BIT(3) * m->facet_q[i];
    if (j == k + 1) flags |= DELAUNAY_FACET_BIT(1) * m->facet_q[k];
    if (i == 0 && j == g->n - 1) flags |= DELAUNAY_FACET_BIT(2) * m->facet_q[j];
    c = mesher__new_cell(f, g->p, g->r[i], g->r[k], g->r[j], flags);
    if (i > 0 || j < g->n - 1) mesher__edge_made(f, g->r[i], g->r[j]);
    flags = DELAUNAY_EDGE_BIT(0) * m->at_q[i] | DELAUNAY_EDGE_BIT(1) * m->at_q[j] |
            DELAUNAY_EDGE_BIT(2) * m->at_q[k] | DELAUNAY_EDGE_BIT(3) * rim_ij |
            DELAUNAY_EDGE_BIT(4) * rim_ik | DELAUNAY_EDGE_BIT(5) * rim_kj;
    if (k == i + 1) flags |= DELAUNAY_FACET_BIT(2) * m->facet_p[i];
    if (j == k + 1) flags |= DELAUNAY_FACET_BIT(1) * m->facet_p[k];
    if (i == 0 && j == g->n - 1) flags |= DELAUNAY_FACET_BIT(3) * m->facet_p[j];
    d = mesher__new_cell(f, g->q, g->r[i], g->r[j], g->r[k], flags);
    mesher__cells_link(f, 4 * c, 4 * d);
    mesher__fill_ring(f, g, m, i, k, below);
    mesher__fill_ring(f, g, m, k, j, above);
    mesher__cells_link(f, 4 * c + 3, below[0]);
    mesher__cells_link(f, 4 * d + 2, below[1]);
    mesher__cells_link(f, 4 * c + 1, above[0]);
    mesher__cells_link(f, 4 * d + 1, above[1]);
    sides[0] = 4 * c + 2;
    sides[1] = 4 * d + 3;
}

/* Removes the edge of a ring, if there is room, by the triangulation that was just found for the
 * ring. */
static void mesher__flip_ring(mesher__flips *f, const mesher__ring *g)
{
    mesher__ring_marks m;
    uint32_t i, n = g->n;
    delaunay_handle sides[2];
    if (!mesher__flip_room(f, n, 2 * (n - 2))) return;
    for (i = 0; i < n; i++) {
        const mesher__copy *c = &f->cells[g->cells[i]];
        uint32_t p = mesher__cell_place(c, g->p), q = mesher__cell_place(c, g->q);
        uint32_t v = mesher__cell_place(c, g->r[i]), next = 6 - p - q - v;
        m.beyond_q[i] = mesher__beyond(f, g->cells[i], q);
        m.beyond_p[i] = mesher__beyond(f, g->cells[i], p);
        if (!m.beyond_q[i] || !m.beyond_p[i]) return;
        m.at_p[i] = mesher__edge_bit(c, p, v);
        m.at_q[i] = mesher__edge_bit(c, q, v);
        m.rim[i] = mesher__edge_bit(c, v, next);
        m.facet_q[i] = c->flags >> q & 1;
        m.facet_p[i] = c->flags >> p & 1;
    }
    if (!mesher__flip_room(f, n, 2 * (n - 2))) return; /* copies may have been made */
    for (i = 0; i < n; i++) mesher__cell_goes(f, g->cells[i]);
    mesher__fill_ring(f, g, &m, 0, n - 1, sides);
    mesher__cells_link(f, sides[0], m.beyond_q[n - 1]);
    mesher__cells_link(f, sides[1], m.beyond_p[n - 1]);
    mesher__flip_done(f, n, 2 * (n - 2));
}

/* Flips two tetrahedra to three, if that is possible: facet k of a cell is replaced by the edge
 * between the two opposite vertices. */
static void mesher__flip_face(mesher__flips *f, uint32_t cell, uint32_t k)
{
    const uint8_t *o = delaunay_facet_order((int)k);
    const mesher__copy *c = &f->cells[cell], *b;
    delaunay_handle h = mesher__beyond(f, cell, k), out[3][2];
    uint32_t d = c->v[k], e, w[3], in_b[3], made[3], i, j;
    unsigned flags[3];
    if (!h || (c->flags & DELAUNAY_FACET_BIT(k))) return;
    b = &f->cells[h / 4];
    e = b->v[h % 4];
    if (b->v[3] == DELAUNAY_GHOST) return;
    for (i = 0; i < 3; i++) w[i] = c->v[o[i]];
    f->work += 3;
    for (i = 0; i < 3; i++)
        if (mesher__flip_orient(f, d, w[i], w[(i + 1) % 3], e) <= 0) return;
    for (i = 0; i < 3; i++) in_b[i] = mesher__cell_place(b, w[i]);
    for (i = 0; i < 3; i++) {
        uint32_t x = o[i], y = o[(i + 1) % 3], z = o[(i + 2) % 3]; /* places in c, then in b */
        uint32_t bx = in_b[i], by = in_b[(i + 1) % 3], bz = in_b[(i + 2) % 3];
        out[i][0] = mesher__beyond(f, cell, z);
        out[i][1] = mesher__beyond(f, (uint32_t)(h / 4), bz);
        if (!out[i][0] || !out[i][1]) return;
        flags[i] = DELAUNAY_EDGE_BIT(0) * mesher__edge_bit(c, k, x) |
                   DELAUNAY_EDGE_BIT(1) * mesher__edge_bit(c, k, y) |
                   DELAUNAY_EDGE_BIT(3) * mesher__edge_bit(c, x, y) |
                   DELAUNAY_EDGE_BIT(4) * mesher__edge_bit(b, bx, (uint32_t)(h % 4)) |
                   DELAUNAY_EDGE_BIT(5) * mesher__edge_bit(b, by, (uint32_t)(h % 4)) |
                   DELAUNAY_FACET_BIT(3) * (c->flags >> z & 1u) |
                   DELAUNAY_FACET_BIT(0) * (b->flags >> bz & 1u);
    }
    if (!mesher__flip_room(f, 2, 3)) return;
    mesher__cell_goes(f, cell);
    mesher__cell_goes(f, (uint32_t)(h / 4));
    for (i = 0; i < 3; i++) made[i] = mesher__new_cell(f, d, w[i], w[(i + 1) % 3], e, flags[i]);
    for (i = 0; i < 3; i++) {
        j = (i + 1) % 3;
        mesher__cells_link(f, 4 * made[i] + 3, out[i][0]);
        mesher__cells_link(f, 4 * made[i], out[i][1]);
        mesher__cells_link(f, 4 * made[i] + 1, 4 * made[j] + 2);
    }
    mesher__edge_made(f, d, e);
    mesher__flip_done(f, 2, 3);
}

/* Is edge pq one of those whose removal is under way at lower levels of the recursion? */
static int mesher__edge_waits(const mesher__flips *f, int level, uint32_t p, uint32_t q)
{
    int i;
    for (i = 0; i < level; i++)
        if ((f->edges[i][0] == p && f->edges[i][1] == q) ||
            (f->edges[i][0] == q && f->edges[i][1] == p))
            return 1;
    return 0;
}

/* Updates the ring of pq after flips beside it. 0, with the flips taken back, if pq cannot be
 * removed any more. */
static int mesher__ring_again(mesher__flips *f, uint32_t mark, mesher__ring *ring)
{
    mesher__ring now;
    uint32_t cell = mesher__cell_with(f, ring->p, ring->q);
    if (cell && mesher__ring_of(f, cell, ring->p, ring->q, &now)) {
        *ring = now;
        return 1;
    }
    mesher__flips_undo(f, mark);
    return 0;
}

/* Do the rings of edges that wait share more than two tetrahedra with a ring? The one that waits
 * for this removal shares two. */
static int mesher__ring_overlaps(const mesher__flips *f, const mesher__ring *g)
{
    uint32_t i, shared = 0;
    for (i = 0; i < g->n; i++) shared += f->cells[g->cells[i]].rings;
    return shared > 2;
}

/* Notes that the edge of a ring waits to be removed (add is 1), or does not any more (-1). */
static void mesher__ring_waits(mesher__flips *f, const mesher__ring *g, int add)
{
    uint32_t i;
    for (i = 0; i < g->n; i++)
        f->cells[g->cells[i]].rings = (uint8_t)(f->cells[g->cells[i]].rings + add);
}

/* Removes edge pq of a cell, if possible. If its ring has no triangulation, edges that prevent one
 * are removed first, recursively, to the given depth. ear: a vertex of the ring that may get no new
 * edge (0: none). Flips that do not lead to the removal stay: they may free what is stuck for a
 * later try. */
static void mesher__remove_edge(mesher__flips *f, uint32_t cell, uint32_t p, uint32_t q,
                                uint32_t ear, int level, int depth)
{
    mesher__ring g;
    uint32_t i, n, side, mark;
    if (f->budget == 0) return;
    f->budget--;
    if (!mesher__ring_of(f, cell, p, q, &g)) return;
    f->work += g.n;
    if (f->apart && mesher__ring_overlaps(f, &g)) return;
    if (mesher__triangulate_ring(f, &g, ear)) {
        mesher__flip_ring(f, &g);
        return;
    }
    if (depth == 0) return;
    f->edges[level][0] = p;
    f->edges[level][1] = q;
    for (i = 0; i < g.n && g.n > 3 && !f->full; i++) {
        uint32_t x = g.r[(i + g.n - 1) % g.n], y = g.r[i], z = g.r[(i + 1) % g.n];
        if (y == ear || mesher__flip_orient(f, p, q, x, z) <= 0) continue;
        for (side = 0; side < 2; side++) {
            uint32_t s = side ? q : p, t = side ? p : q;
            int sign = mesher__flip_orient(f, s, x, y, z);
            if ((side ? sign < 0 : sign > 0) || mesher__edge_waits(f, level, s, y)) continue;
            mark = f->num_log;
            n = g.n;
            if (f->apart) mesher__ring_waits(f, &g, 1);
            mesher__remove_edge(f, g.cells[i], s, y, t, level + 1, depth - 1);
            if (f->apart) mesher__ring_waits(f, &g, -1);
            if (f->num_log == mark || !mesher__ring_again(f, mark, &g)) continue;
            if (mesher__triangulate_ring(f, &g, ear)) {
                mesher__flip_ring(f, &g);
                return;
            }
            if (g.n < n) i = UINT32_MAX; /* the ring is smaller: start again */
            break;
        }
    }
}

/* Appends an obstacle to a way: facet k of a cell, with vertices x, y, z, or edge xy of it (k < 0).
 * Returns 1; -1: it is a constraint, or there is no room. */
static int mesher__way_add(mesher__flips *f, mesher__way *way, uint32_t cell, int k, uint32_t x,
                           uint32_t y, uint32_t z)
{
    mesher__obstacle *o = &way->at[way->count];
    const mesher__copy *c = &f->cells[cell];
    if (way->count == MESHER__WAY) {
        way->cut = 1;
        return -1;
    }
    if (k < 0 ? mesher__cell_edge(c, x, y) : (c->flags & DELAUNAY_FACET_BIT(k)) != 0) return -1;
    way->count++;
    o->cell = cell;
    o->k = k;
    o->v[0] = x;
    o->v[1] = y;
    o->v[2] = z;
    o->order[0] = MESHER__UNORDERED;
    return 1;
}

/* Begins the way at vertex a: finds the tetrahedron of its star that the missing edge enters. 1: an
 * obstacle was added, 0: that tetrahedron has b, -1: neither. */
static int mesher__way_start(mesher__flips *f, mesher__way *way)
{
    delaunay_handle t = f->mesh->vertex_tet[f->a];
    uint32_t cell = f->start ? f->start : t ? mesher__cell_of(f, t) : 0, step;
    if (cell && (f->cells[cell].gone || mesher__cell_index(&f->cells[cell], f->a) < 0))
        cell = mesher__cell_with(f, f->a, f->a); /* the number is reused */
    for (step = 0; cell && step < 300; step++) {
        const mesher__copy *c = &f->cells[cell];
        int i = mesher__cell_index(c, f->a), k, s[3];
        const uint8_t *o = delaunay_facet_order(i);
        uint32_t w[3];
        delaunay_handle h;
        if (c->v[3] == DELAUNAY_GHOST) return -1;
        for (k = 0; k < 3; k++)
            if ((w[k] = c->v[o[k]]) == f->b) return 0;
        for (k = 0; k < 3; k++) { /* the first one varies, so that the walk does not circle */
            int m = (k + (int)step) % 3;
            s[m] = mesher__turn(f, w[m], w[(m + 1) % 3]);
            if (s[m] < 0) break;
        }
        f->work += 3;
        if (k == 3) {
            int zeros = (s[0] == 0) + (s[1] == 0) + (s[2] == 0);
            f->start = cell;
            if (zeros > 1) return -1;
            if (!zeros) return mesher__way_add(f, way, cell, i, w[0], w[1], w[2]);
            k = s[0] == 0 ? 0 : s[1] == 0 ? 1 : 2;
            return mesher__way_add(f, way, cell, -1, w[k], w[(k + 1) % 3], 0);
        }
        k = (k + (int)step) % 3;
        h = mesher__beyond(f, cell, o[(k + 2) % 3]);
        cell = (uint32_t)(h / 4);
    }
    return -1;
}

/* Continues the way from a face; returns the same. */
static int mesher__way_from_face(mesher__flips *f, mesher__way *way)
{
    const mesher__obstacle *o = &way->at[way->count - 1];
    delaunay_handle h = mesher__beyond(f, o->cell, (uint32_t)o->k);
    const mesher__copy *c = &f->cells[h / 4];
    uint32_t e = c->v[h % 4], w[3];
    int t[3], i, zeros = 0, zero = 0;
    if (!h || c->v[3] == DELAUNAY_GHOST) return -1;
    if (e == f->b) return 0;
    memcpy(w, o->v, sizeof w);
    f->work += 3;
    for (i = 0; i < 3; i++) {
        t[i] = mesher__turn(f, w[i], e);
        if (t[i] == 0) zeros++, zero = i;
    }
    if (zeros > 1) return -1;
    for (i = 0; i < 3; i++)
        if (t[i] < 0 && t[(i + 1) % 3] > 0)
            return mesher__way_add(f, way, (uint32_t)(h / 4),
                                   (int)mesher__cell_place(c, w[(i + 2) % 3]), w[i], w[(i + 1) % 3],
                                   e);
    return zeros ? mesher__way_add(f, way, (uint32_t)(h / 4), -1, w[zero], e, 0) : -1;
}

/* Continues the way from edge xy through a cell, whose other vertices are u and v; x, y, u, v are
 * positive in this order. side_u, side_v: the signs of xyub and xyvb. */
static int mesher__way_through(mesher__flips *f, mesher__way *way, uint32_t cell, uint32_t x,
                               uint32_t y, uint32_t u, uint32_t v, int side_u, int side_v)
{
    const mesher__copy *c = &f->cells[cell];
    int i, s = mesher__turn(f, u, v);
    if (side_u == 0 || side_v == 0) { /* the way goes on in face xyu, or xyv */
        uint32_t in = side_u == 0 ? u : v, off = side_u == 0 ? v : u;
        int of_in = mesher__turn(f, in, off), of_x = mesher__turn(f, x, off);
        if (of_in == 0) return -1;
        return mesher__way_add(f, way, cell, -1, in, of_in == of_x ? y : x, 0);
    }
    if (s == 0) return mesher__way_add(f, way, cell, -1, u, v, 0);
    for (i = 0; i < 2; i++) {
        uint32_t p = i ? y : x, other = i ? x : y;
        if (mesher__turn(f, p, u) != s || mesher__turn(f, v, p) != s) continue;
        return mesher__way_add(f, way, cell, (int)mesher__cell_place(c, other), p, s > 0 ? u : v,
                               s > 0 ? v : u);
    }
    return -1;
}

/* Continues the way from an edge; returns the same. */
static int mesher__way_from_edge(mesher__flips *f, mesher__way *way)
{
    const mesher__obstacle *o = &way->at[way->count - 1];
    mesher__ring g;
    uint32_t i, x = o->v[0], y = o->v[1];
    int side[MESHER__RING];
    if (!mesher__ring_of(f, o->cell, x, y, &g)) return -1;
    f->work += g.n;
    for (i = 0; i < g.n; i++) {
        if (g.r[i] == f->b) return 0;
        side[i] = mesher__flip_orient(f, x, y, g.r[i], f->b);
    }
    for (i = 0; i < g.n; i++) {
        uint32_t j = (i + 1) % g.n;
        if (side[i] >= 0 && side[j] <= 0 && (side[i] || side[j]))
            return mesher__way_through(f, way, g.cells[i], x, y, g.r[i], g.r[j], side[i], side[j]);
    }
    return -1;
}

/* The way of the missing edge: all that it crosses, from a on. Returns the number of obstacles; 0:
 * the edge is in the copy; MESHER__ABSENT: a constraint or a vertex is in the way, or no room in
 * the copy; more than MESHER__WAY: there are more than the way has room for. */
static uint32_t mesher__find_way(mesher__flips *f, mesher__way *way)
{
    int more;
    way->count = 0;
    way->cut = 0;
    more = mesher__way_start(f, way);
    while (more > 0)
        more = way->at[way->count - 1].k < 0 ? mesher__way_from_edge(f, way)
                                             : mesher__way_from_face(f, way);
    if (way->cut) return MESHER__WAY + 1;
    return more < 0 ? MESHER__ABSENT : way->count;
}

/* Notes that an edge is about to be tried. 0: it has been tried since the last change. */
static int mesher__first_try(mesher__flips *f, uint32_t p, uint32_t q)
{
    uint64_t edge = mesher__pair(p, q);
    uint32_t i;
    for (i = 0; i < f->num_tried; i++)
        if (f->tried[i] == edge) return 0;
    f->tried[f->num_tried++] = edge;
    return 1;
}

/* Sorts the edges of a crossed face by their distances from the missing edge, in the view along it:
 * the nearest one is most often the one to remove. */
static void mesher__nearest_first(mesher__flips *f, mesher__obstacle *o)
{
    double distance[3];
    uint8_t i, j;
    for (i = 0; i < 3; i++) {
        const mesher__view *v = mesher__view_of(f, o->v[i]);
        double x = v->x, y = v->y, dx, dy, turn;
        v = mesher__view_of(f, o->v[(i + 1) % 3]);
        dx = v->x - x;
        dy = v->y - y;
        turn = x * dy - y * dx;
        distance[i] = turn * turn / (dx * dx + dy * dy);
        for (j = i; j > 0 && distance[i] < distance[o->order[j - 1]]; j--)
            o->order[j] = o->order[j - 1];
        o->order[j] = i;
    }
}

/* Tries the i-th way to remove an obstacle: of a face its flip, then the removal of each of its
 * edges; of an edge its removal. */
static void mesher__flip_obstacle(mesher__flips *f, mesher__obstacle *o, int i, int depth)
{
    uint32_t e = 0;
    if (o->k < 0 && i > 0) return;
    if (o->k >= 0 && i == 0) {
        mesher__flip_face(f, o->cell, (uint32_t)o->k);
        return;
    }
    if (o->k >= 0) {
        if (o->order[0] == MESHER__UNORDERED) mesher__nearest_first(f, o);
        e = o->order[i - 1];
    }
    if (mesher__first_try(f, o->v[e], o->v[(e + 1) % 3]))
        mesher__remove_edge(f, o->cell, o->v[e], o->v[(e + 1) % 3], 0, 0, depth);
}

/* Is the missing edge among those that flips made, from number first on, and still there? */
static int mesher__edge_is_made(const mesher__flips *f, uint32_t first)
{
    uint32_t i;
    for (i = first; i < f->num_made; i++)
        if (mesher__pair(f->made[i][0], f->made[i][1]) == mesher__pair(f->a, f->b))
            return mesher__cell_with(f, f->a, f->b) != 0;
    return 0;
}

/* Flips obstacles, from both ends of the way inwards, and keeps flips that leave no more obstacles
 * than before. Returns 1 as soon as there are fewer, else 0. */
static int mesher__flip_once(mesher__flips *f, int depth)
{
    uint32_t n = f->way[0].count, j, mark, made, left;
    int i;
    f->num_tried = 0;
    for (j = 0; j < n && !f->full; j++)
        for (i = 0; i < 4 && !f->full; i++) {
            mesher__obstacle *o = &f->way[0].at[j % 2 ? n - 1 - j / 2 : j / 2];
            mark = f->num_log;
            made = f->num_made;
            mesher__flip_obstacle(f, o, i, depth);
            if (f->num_log == mark) continue;
            left = 0;
            f->way[1].count = 0;
            if (!mesher__edge_is_made(f, made)) left = mesher__find_way(f, &f->way[1]);
            if (left > n) {
                mesher__flips_undo(f, mark);
                continue;
            }
            f->way[0].count = f->way[1].count;
            memcpy(f->way[0].at, f->way[1].at, left * sizeof *f->way[0].at);
            if (left < n) return 1;
            f->num_tried = 0;
        }
    return 0;
}

/* Flips until missing edge ab is in the copy, or nothing helps any more. */
static void mesher__flip_edge(mesher__flips *f, const delaunay_mesh *mesh, uint32_t a, uint32_t b,
                              int depth)
{
    mesher__flips_clear(f, mesh, a, b);
    if (mesher__find_way(f, &f->way[0]) > MESHER__WAY) return;
    while (f->way[0].count > 0 && mesher__flip_once(f, depth)) {}
}

/* How many faces of a cell the missing edge crosses. */
static int mesher__faces_in_way(mesher__flips *f, uint32_t cell)
{
    const uint32_t *v = f->cells[cell].v;
    mesher__sights s;
    uint32_t i;
    int count = 0;
    for (i = 0; i < 4; i++) {
        s.v[i] = v[i];
        s.view[i] = *mesher__view_of(f, v[i]);
    }
    for (i = 0; i < 4; i++)
        count += (int)mesher__in_way(f, &s, (i + 1) & 3, (i + 2) & 3, (i + 3) & 3);
    return count;
}

/* By how many the flips of the log, from place mark on, lower the number of faces that the missing
 * edge crosses; times two. */
static int mesher__fewer_in_way(mesher__flips *f, uint32_t mark)
{
    uint32_t end = f->num_log, i;
    int fewer = 0;
    while (end > mark) {
        uint32_t made = f->log[end - 1], gone = f->log[end - 2];
        end -= 2;
        for (i = 0; i < made; i++) fewer -= mesher__faces_in_way(f, f->log[--end]);
        for (i = 0; i < gone; i++) fewer += mesher__faces_in_way(f, f->log[--end]);
    }
    return fewer;
}

/* Flips an obstacle of the way, one of the first count, and keeps flips by which there are fewer,
 * or the edge is there. 0: impossible. */
static int mesher__flip_first(mesher__flips *f, uint32_t count, int depth)
{
    uint32_t mark = f->num_log, made = f->num_made, i;
    f->num_tried = 0;
    f->budget = MESHER__END_BUDGET;
    for (i = 0; i < 4 * count && f->budget && !f->full; i++) {
        mesher__flip_obstacle(f, &f->way[0].at[i / 4], (int)(i % 4), depth);
        if (f->num_log == mark) continue;
        if (mesher__fewer_in_way(f, mark) > 0 || mesher__edge_is_made(f, made)) return 1;
        mesher__flips_undo(f, mark);
    }
    return 0;
}

/* Flips from end a of missing edge ab on, one obstacle after the other; those behind the first one,
 * too, if far_too is set. Removals that nest stay apart, which leaves few to try, and so they may
 * be deep. */
static void mesher__flip_from(mesher__flips *f, const delaunay_mesh *mesh, uint32_t a, uint32_t b,
                              int far_too, int depth)
{
    mesher__flips_clear(f, mesh, a, b);
    f->apart = 1;
    f->ring_filled = MESHER__RING_FILLED;
    while (f->num_log < MESHER__END_LOG) {
        uint32_t n = mesher__find_way(f, &f->way[0]);
        if (n == 0 || n == MESHER__ABSENT) return;
        if (!mesher__flip_first(f, far_too ? f->way[0].count : 1, depth)) return;
    }
}

/* Lists the tetrahedra that flips removed, and the cells that they made, and numbers these. 0: too
 * many. */
static int mesher__list_flips(const mesher__flips *f, mesher__flipped *p, uint32_t *made,
                              uint32_t *number)
{
    uint32_t i, word;
    p->num_old = p->num_new = 0;
    memset(number, 0, f->num_cells * sizeof *number);
    for (i = 0; i < f->num_cells; i += 32)
        for (word = f->changed[i / 32]; word; word &= word - 1) {
            uint32_t cell = i + mesher__lowest_bit(word);
            const mesher__copy *c = &f->cells[cell];
            if (c->from ? !c->gone : c->gone) continue;
            if ((c->from ? p->num_old : p->num_new) == MESHER__FLIPPED) return 0;
            if (c->from) {
                p->old[p->num_old++] = c->from;
            } else {
                number[cell] = p->num_new;
                made[p->num_new++] = cell;
            }
        }
    return 1;
}

/* Describes the cells that flips made, with their links, all of which the copy has. */
static void mesher__list_made(const mesher__flips *f, mesher__flipped *p, const uint32_t *made,
                              const uint32_t *number)
{
    uint32_t j, k;
    for (j = 0; j < p->num_new; j++) {
        const mesher__copy *c = &f->cells[made[j]];
        memcpy(p->vertices + 4 * (size_t)j, c->v, sizeof c->v);
        p->flags[j] = c->flags;
        for (k = 0; k < 4; k++) {
            uint32_t other = (uint32_t)(c->n[k] / 4), side = (uint32_t)(c->n[k] % 4);
            delaunay_handle from = f->cells[other].from;
            p->link[4 * (size_t)j + k] = 4 * (from + number[other]) + side; /* one of them is 0 */
            p->inside[4 * (size_t)j + k] = !from;
        }
    }
}

/* Lists the missing edges among those that flips made (and may have removed again). 0: too many. */
static int mesher__list_edges_made(const mesher__recovery *r, const mesher__flips *f,
                                   mesher__flipped *p)
{
    uint32_t k;
    p->num_edges = 0;
    for (k = 0; k < f->num_made; k++) {
        uint32_t a = f->made[k][0], b = f->made[k][1], e;
        if (a >= r->cap_at || b >= r->cap_at || !r->missing_edges_at[a] || !r->missing_edges_at[b])
            continue;
        e = mesher__edge_index(r, a, b);
        if (e == MESHER__ABSENT || r->edge_present[e]) continue;
        if (p->num_edges == MESHER__FLIPPED_EDGES) return 0;
        p->edges[p->num_edges++] = e;
    }
    return 1;
}

/* Which vertex of a tetrahedron x is, or -1. */
static int mesher__corner_of(const uint32_t *v, uint32_t x)
{
    return v[0] == x ? 0 : v[1] == x ? 1 : v[2] == x ? 2 : v[3] == x ? 3 : -1;
}

/* Marks the missing edges that are among those of the new tetrahedra: all tetrahedra around such an
 * edge are new. Those that flips have removed again leave the list. */
static void mesher__mark_edges_made(const mesher__recovery *r, mesher__flipped *p)
{
    uint32_t i, k, n = 0;
    for (k = 0; k < p->num_edges; k++) {
        uint32_t e = p->edges[k], a = r->edges[2 * (size_t)e], b = r->edges[2 * (size_t)e + 1];
        int there = 0;
        for (i = 0; i < p->num_new; i++) {
            int at_a = mesher__corner_of(p->vertices + 4 * i, a),
                at_b = mesher__corner_of(p->vertices + 4 * i, b);
            if (at_a < 0 || at_b < 0) continue;
            p->flags[i] = (uint16_t)(p->flags[i] |
                                     DELAUNAY_EDGE_BIT(delaunay_edge_between(at_a, at_b)));
            there = 1;
        }
        if (there) p->edges[n++] = e;
    }
    p->num_edges = n;
}

/* The facets of a tetrahedron that have three constrained edges, as bits. */
static unsigned mesher__closed_facets(unsigned flags)
{
    unsigned closed = 0;
    int k;
    for (k = 0; k < 4; k++) closed |= (unsigned)!(mesher__facet_edges(k) & ~flags) << k;
    return closed;
}

/* Lists and marks the missing facets that flips have made, which are between two new tetrahedra.
 * The marks of edges are there already. */
static void mesher__mark_facets_made(const mesher__recovery *r, mesher__flipped *p)
{
    uint32_t i;
    p->num_facets = 0;
    for (i = 0; i < p->num_new && r->num_missing_facets; i++) {
        unsigned left = mesher__closed_facets(p->flags[i]);
        for (left &= ~(unsigned)p->flags[i]; left; left &= left - 1) {
            uint32_t k = mesher__lowest_bit(left), other = (uint32_t)(p->link[4 * i + k] / 4), f;
            if (!p->inside[4 * i + k]) continue;
            f = mesher__missing_facet(r, p->vertices + 4 * i, (int)k);
            if (f == MESHER__ABSENT) continue;
            p->flags[i] = (uint16_t)(p->flags[i] | DELAUNAY_FACET_BIT(k));
            if (i < other) p->facets[p->num_facets++] = f; /* once, of two sides */
        }
    }
}

/* Takes the result of flips out of the copy. 0: too large, it counts as no flips. */
static int mesher__flips_take(const mesher__recovery *r, const mesher__flips *f, mesher__flipped *p)
{
    uint32_t made[MESHER__FLIPPED], number[MESHER__CELLS];
    if (!mesher__list_flips(f, p, made, number) || !mesher__list_edges_made(r, f, p)) {
        p->num_old = p->num_new = 0;
        return 0;
    }
    mesher__list_made(f, p, made, number);
    mesher__mark_edges_made(r, p);
    mesher__mark_facets_made(r, p);
    return 1;
}

/* The result of flips around missing edge e; 0: it is too large. Several threads may do this at
 * once, while nobody writes to the mesh. */
static int mesher__try_flips(const mesher__recovery *r, mesher__flips *f, uint32_t e, int depth,
                             mesher__flipped *p)
{
    const uint32_t *v = r->edges + 2 * (size_t)e, a = v[r->from_second], b = v[!r->from_second];
    f->budget = 16u << (depth < 4 ? depth : 4);
    f->work = 0;
    p->start = r->mesh->vertex_tet[a];
    if (r->from_ends) mesher__flip_from(f, r->mesh, a, b, r->far_too, depth);
    else mesher__flip_edge(f, r->mesh, a, b, depth);
    p->work = f->work;
    return mesher__flips_take(r, f, p);
}

/* Lists the tetrahedra that the result depends on: all that were copied. 0: too many. */
static int mesher__list_read(const mesher__flips *f, mesher__flipped *p)
{
    uint32_t i;
    p->num_read = 0;
    for (i = 1; i < f->num_cells; i++) {
        if (!f->cells[i].from) continue;
        if (p->num_read == MESHER__FLIPPED_READ) return 0;
        p->read[p->num_read++] = f->cells[i].from;
    }
    return 1;
}

/* Commits the result of flips to the mesh, outside transactions: it removes no constraint. */
static int mesher__commit_flips(mesher__recovery *r, const mesher__flipped *p)
{
    delaunay_links links;
    uint32_t i;
    if (p->num_new == 0) return 0;
    links.link = p->link;
    links.inside = p->inside;
    links.flags = p->flags;
    mesher__note_failure(r, delaunay_replace_linked(r->mesh, r->worker, p->old, p->num_old,
                                                    p->vertices, &links, p->num_new, r->slots));
    if (r->status != MESHER_OK) return 0;
    for (i = 0; i < p->num_edges; i++) mesher__set_edge_present(r, p->edges[i], 1);
    for (i = 0; i < p->num_facets; i++) mesher__set_facet_present(r, p->facets[i], 1);
    mesher__note_new(r, p->num_new);
    return r->status == MESHER_OK;
}

/* Tries to bring in missing edge e by flips; 1 if it is there. Flips that do not lead there stay,
 * too. */
static int mesher__recover_by_flips(mesher__recovery *r, uint32_t e)
{
    mesher__flipped *p = r->flipped;
    mesher__try_flips(r, r->flips, e, MESHER__FLIP_DEPTH / 2, p);
    r->work += p->work;
    return mesher__commit_flips(r, p) && r->edge_present[e];
}

/* -- many edges at a time: all threads try flips for the next few edges, each in its own copy; then
 * one thread commits the results, in order. A result that depends on tetrahedra which have changed
 * by then is found anew. So the mesh is the same as by one thread that does one edge after the
 * other. */

/* Marks what a commit changed: the tetrahedra that it removed and made, and the neighbours of those
 * that it made. */
static void mesher__note_changes(mesher__recovery *r, const mesher__flipped *p)
{
    uint32_t i;
    for (i = p->num_new; i < p->num_old; i++) mesher__note_change(r, p->old[i]);
    for (i = 0; i < p->num_new; i++) mesher__note_change(r, r->slots[i]);
    for (i = 0; i < 4 * p->num_new; i++)
        if (!p->inside[i]) mesher__note_change(r, p->link[i] / 4);
}

/* Would a new try of edge e have the same result? */
static int mesher__still_holds(const mesher__recovery *r, uint32_t e, const mesher__flipped *p)
{
    uint32_t i;
    unsigned touched = 0;
    if (!p->whole) return 0;
    if (r->mesh->vertex_tet[r->edges[2 * (size_t)e + r->from_second]] != p->start) return 0;
    for (i = 0; i < p->num_read; i++) touched |= r->mesh->mark[p->read[i]];
    return !touched;
}

/* Asks for the memory that flips for the next few edges of the list begin with: what is asked for
 * at one edge is used at a later one to ask for more. */
static void mesher__fetch_wanted(const mesher__recovery *r, uint32_t i)
{
    const delaunay_mesh *mesh = r->mesh;
    if (i + 16 < r->num_wanted) MESHER__PREFETCH(r->edges + 2 * (size_t)r->wanted[i + 16]);
    if (i + 12 < r->num_wanted) {
        const uint32_t *v = r->edges + 2 * (size_t)r->wanted[i + 12];
        MESHER__PREFETCH(mesh->vertex_tet + v[0]);
        MESHER__PREFETCH(mesh->vertices + v[0]);
        MESHER__PREFETCH(mesh->vertices + v[1]);
    }
    if (i + 8 < r->num_wanted) {
        delaunay_handle t = mesh->vertex_tet[r->edges[2 * (size_t)r->wanted[i + 8]]];
        MESHER__PREFETCH(mesh->tets + t);
        MESHER__PREFETCH(mesh->flags + t);
    }
    if (i + 4 < r->num_wanted) {
        const delaunay_tet *t =
            mesh->tets + mesh->vertex_tet[r->edges[2 * (size_t)r->wanted[i + 4]]];
        int k;
        for (k = 0; k < 4; k++) {
            MESHER__PREFETCH(mesh->tets + t->n[k] / 4);
            MESHER__PREFETCH(mesh->flags + t->n[k] / 4);
            MESHER__PREFETCH(mesh->vertices + t->v[k]);
        }
    }
}

/* The results of flips for the edges first .. end - 1 of the list, each for itself. The threads
 * share the mesh and the recovery, which they only read. */
static void mesher__try_ahead(mesher__recovery *r, uint32_t first, uint32_t end, int depth,
                              int threads)
{
    double work = 0;
    int64_t i;
    (void)threads;
    MESHER__OMP(omp parallel num_threads(threads) reduction(+ : work))
    {
        double begin = delaunay_cpu_seconds();
        mesher__flips *f = r->flips + MESHER__THREAD();
        MESHER__OMP(omp for schedule(dynamic, 1) nowait)
        for (i = first; i < (int64_t)end; i++) {
            mesher__flipped *p = r->flipped + (i - first);
            p->whole = mesher__try_flips(r, f, r->wanted[i], depth, p) && mesher__list_read(f, p);
        }
        work += delaunay_cpu_seconds() - begin;
    }
    delaunay_crew_end(&r->crew, work);
}

/* Goes on with flips from one end of an edge after a success, until there is none, or the edge is
 * in. */
static void mesher__flip_on(mesher__recovery *r, uint32_t e, int depth, int note)
{
    mesher__flipped *p = r->flipped;
    while (!r->edge_present[e] && !mesher__stopped(r)) {
        mesher__try_flips(r, r->flips, e, depth, p);
        r->work += p->work;
        if (!mesher__commit_flips(r, p)) return;
        if (note) mesher__note_changes(r, p);
    }
}

/* Flips for the edges first .. end - 1 of the list, tried by all threads at once if that pays. */
static void mesher__flip_batch(mesher__recovery *r, uint32_t first, uint32_t end, int depth)
{
    uint32_t i;
    int threads = delaunay_crew_begin(&r->crew, r->num_flips > 1 && end - first <= r->num_flipped);
    if (threads > (int)r->num_flips) threads = (int)r->num_flips;
    if (threads > 1) mesher__try_ahead(r, first, end, depth, threads);
    for (i = first; i < end && !mesher__stopped(r); i++) {
        mesher__flipped *p = r->flipped + (threads > 1 ? i - first : 0);
        uint32_t e = r->wanted[i];
        mesher__fetch_wanted(r, i);
        if (r->edge_present[e]) continue;
        if (threads == 1 || !mesher__still_holds(r, e, p))
            mesher__try_flips(r, r->flips, e, depth, p);
        r->work += p->work;
        if (!mesher__commit_flips(r, p)) continue;
        if (threads > 1) mesher__note_changes(r, p);
        if (r->from_ends) mesher__flip_on(r, e, depth, threads > 1);
    }
    mesher__forget_changes(r);
}

/* Lists the missing edges: in their own order at the first attempt, shuffled at the others, and for
 * flips from the ends. */
static void mesher__shuffle_edges(mesher__recovery *r)
{
    uint32_t e, i, n = 0;
    int shuffle = r->attempt || r->from_ends;
    if (r->from_ends) r->random += 2;
    for (e = 0; e < r->num_edges; e++)
        if (!r->edge_present[e])
            r->order[n++] = (shuffle ? mesher__mix(e + r->random) << 32 : 0) | e;
    if (shuffle && n > 1) qsort(r->order, n, sizeof *r->order, mesher__compare_u64);
    for (i = 0; i < n; i++) r->wanted[i] = (uint32_t)r->order[i];
    r->num_wanted = n;
}

/* Reorders the list: the first edge of each strand, then the second of each, and so on. Returns the
 * number of strands, 1 if there are too few edges. */
static uint32_t mesher__twist_edges(mesher__recovery *r)
{
    uint32_t n = r->num_wanted, strands = n / MESHER__STRAND, length, i, k, m = 0;
    if (n < MESHER__STRAND) return 1;
    if (strands < MESHER__FEW_STRANDS) strands = MESHER__FEW_STRANDS;
    if (strands > MESHER__STRANDS) strands = MESHER__STRANDS;
    length = (n + strands - 1) / strands;
    for (i = 0; i < length; i++)
        for (k = i; k < n; k += length) r->wanted[m++] = (uint32_t)r->order[k];
    return (n + length - 1) / length; /* of this length, there may be fewer */
}

/* Makes room for several threads to try flips for count edges at once; if there is none, one thread
 * does it. */
static void mesher__flips_for_threads(mesher__recovery *r, uint32_t count)
{
    uint32_t threads = (uint32_t)delaunay_threads(&r->domain->options.host);
    void *grown;
    if (threads > count / 2) threads = count / 2;
    if (threads < 2) return;
    if (threads > r->num_flips) {
        grown = delaunay_grow(r->memory, r->flips, r->num_flips, threads, sizeof *r->flips);
        if (!grown) return;
        r->flips = (mesher__flips *)grown;
        while (r->num_flips < threads) r->flips[r->num_flips++].epoch = MESHER__UNUSED;
    }
    if (count > r->num_flipped) {
        grown = delaunay_grow(r->memory, r->flipped, 1, count, sizeof *r->flipped);
        if (!grown) return;
        r->flipped = (mesher__flipped *)grown;
        r->num_flipped = count;
    }
}

/* One pass over all missing edges. */
static void mesher__flip_pass(mesher__recovery *r, int depth)
{
    uint32_t i, end, strands;
    mesher__shuffle_edges(r);
    strands = mesher__twist_edges(r);
    if (strands > 1) mesher__flips_for_threads(r, strands);
    else strands = UINT32_MAX; /* one batch, by one thread */
    for (i = 0; i < r->num_wanted && !mesher__stopped(r); i = end) {
        end = r->num_wanted - i < strands ? r->num_wanted : i + strands;
        mesher__flip_batch(r, i, end, depth);
    }
}

/* Brings in missing edges by flips, in deeper and deeper passes while these help. The depth grows
 * by half and more at a time, up to the last step: a pass does all that a less deep one does, and
 * flips that it leaves behind hinder the next one. */
static void mesher__flip_levels(mesher__recovery *r)
{
    static const uint8_t depths[] = {0, 3, 5, 8, 13, MESHER__FLIP_DEPTH};
    int pass, last = (int)sizeof depths - 1, depth;
    uint32_t before,
        yield = r->domain->options.no_refine ? MESHER__FLIP_YIELD : MESHER__QUICK_YIELD;
    for (pass = 0; pass < MESHER__FLIP_PASSES && r->num_missing_edges; pass++) {
        depth = depths[pass < last ? pass : last];
        before = r->num_missing_edges;
        mesher__flip_pass(r, depth);
        mesher__tell(r, "edges by flips of depth", depth);
        if (depth > 3 && yield * (before - r->num_missing_edges) < before) return;
    }
}

/* Brings in missing edges, if there are many, by flips from their ends, in turn, in deeper and
 * deeper passes. Where hundreds of long edges run beside each other, as on the sides of fine
 * cylinders, nearly all of these passes bring in a few. If so many are left at last that points on
 * them would not be tried, the obstacles behind the first one are. */
static void mesher__flip_ends(mesher__recovery *r)
{
    uint32_t before = r->num_missing_edges;
    int depth, vain = 0;
    if (before <= MESHER__FEW_EDGES) return;
    r->from_ends = 1;
    for (depth = 1; r->num_missing_edges && !mesher__stopped(r); depth++) {
        mesher__flip_pass(r, depth < MESHER__END_DEPTH ? depth : MESHER__END_DEPTH);
        mesher__tell(r, "edges by flips from ends of depth", depth);
        vain = r->num_missing_edges < before ? 0 : vain + 1;
        before = r->num_missing_edges;
        r->from_second ^= 1;
        if (vain < MESHER__END_VAIN) continue;
        if (r->far_too || r->num_missing_edges <= MESHER__FEW_SPLITS) break;
        r->far_too = 1;
        vain = 0;
    }
    r->from_ends = r->far_too = 0;
    r->from_second = 0;
}

/* ---- >>searches  closure searches for edges and facets ------------------------------------ */

/* -- edges */

/* Lowers the number of crossings of a missing edge step by step. Returns 1 if it is in the mesh
 * then; *steps counts the commits. */
static int mesher__reduce_edge(mesher__recovery *r, uint32_t e, const mesher__effort *effort,
                               int *steps)
{
    uint32_t target[3];
    int i;
    target[0] = r->edges[2 * (size_t)e];
    target[1] = r->edges[2 * (size_t)e + 1];
    target[2] = 0;
    for (i = 0; i < 400 && !r->edge_present[e] && !mesher__stopped(r); i++) {
        mesher__walk_edge(r, target[0], target[1]);
        if (r->status != MESHER_OK || mesher__report_edge(r, e)) return 0;
        if (r->pipe.too_long || r->pipe.num_crossings == 0) return 0;
        mesher__windows_of_edge(r, effort->level, effort->max_points);
        if (!mesher__try_windows(r, DELAUNAY_FEWER_FACES, target, effort, &r->edge_present[e], 0))
            return r->edge_present[e];
        ++*steps;
    }
    return r->edge_present[e];
}

/* May segment ab meet a box? No, if both ends are beyond one of its sides. */
static int mesher__meets_box(const mesher__recovery *r, const uint32_t *ab, const double *lo,
                             const double *hi)
{
    const double *a = mesher__x(r, ab[0]), *b = mesher__x(r, ab[1]);
    int k;
    for (k = 0; k < 3; k++)
        if ((a[k] < lo[k] && b[k] < lo[k]) || (a[k] > hi[k] && b[k] > hi[k])) return 0;
    return 1;
}

/* Extends a box to some vertices. */
static void mesher__grow_box(const mesher__recovery *r, const uint32_t *v, size_t count, double *lo,
                             double *hi)
{
    size_t i;
    int k;
    for (i = 0; i < count; i++)
        for (k = 0; k < 3; k++) {
            double x = mesher__x(r, v[i])[k];
            if (x < lo[k]) lo[k] = x;
            if (x > hi[k]) hi[k] = x;
        }
}

/* The cells of the grid that a box meets, as inclusive ranges. Returns their number, or 0 if they
 * are too many. */
static uint32_t mesher__grid_range(const mesher__recovery *r, const double *lo, const double *hi,
                                   int64_t range[3][2])
{
    double cells = 1;
    int k;
    for (k = 0; k < 3; k++) {
        double first = floor(lo[k] / r->grid.step), last = floor(hi[k] / r->grid.step);
        cells *= last - first + 1;
        if (!(cells <= (double)MESHER__GRID_CELLS) || !(fabs(first) < 1e15) || !(fabs(last) < 1e15))
            return 0;
        range[k][0] = (int64_t)first;
        range[k][1] = (int64_t)last;
    }
    return (uint32_t)cells;
}

/* The hash buckets of these cells; some may be there twice. */
static uint32_t mesher__grid_buckets(const mesher__recovery *r, const double *lo, const double *hi,
                                     uint32_t *buckets)
{
    int64_t range[3][2], x, y, z;
    uint32_t n = 0;
    if (!mesher__grid_range(r, lo, hi, range)) return 0;
    for (x = range[0][0]; x <= range[0][1]; x++)
        for (y = range[1][0]; y <= range[1][1]; y++)
            for (z = range[2][0]; z <= range[2][1]; z++)
                buckets[n++] =
                    (uint32_t)mesher__mix((uint64_t)x * 73856093u ^ (uint64_t)y * 19349663u ^
                                          (uint64_t)z * 83492791u) &
                    (r->grid.num_buckets - 1);
    return n;
}

static void mesher__edge_box(const mesher__recovery *r, uint32_t e, double *lo, double *hi)
{
    const double *a = mesher__x(r, r->edges[2 * (size_t)e]),
                 *b = mesher__x(r, r->edges[2 * (size_t)e + 1]);
    int k;
    for (k = 0; k < 3; k++) {
        lo[k] = a[k] < b[k] ? a[k] : b[k];
        hi[k] = a[k] < b[k] ? b[k] : a[k];
    }
}

/* Builds the grid over the missing edges of the list: buckets of edges; bucket num_buckets has the
 * edges that meet too many cells. Returns 0 when out of memory. */
static int mesher__grid_build(mesher__recovery *r)
{
    uint32_t buckets[MESHER__GRID_CELLS], i, j, n, pass, total = 0;
    double lo[3], hi[3], sum = 0;
    for (i = 0; i < r->num_wanted; i++) {
        mesher__edge_box(r, r->wanted[i], lo, hi);
        sum += (hi[0] - lo[0]) + (hi[1] - lo[1]) + (hi[2] - lo[2]);
    }
    r->grid.step = r->num_wanted && sum > 0 ? sum / r->num_wanted : 1;
    for (r->grid.num_buckets = 16; r->grid.num_buckets < 2 * r->num_wanted;
         r->grid.num_buckets *= 2) {}
    delaunay_release(r->memory, r->grid.rows);
    r->grid.rows =
        (uint32_t *)mesher__zeros(r, (size_t)r->grid.num_buckets + 2, sizeof *r->grid.rows);
    for (pass = 0; pass < 2 && r->status == MESHER_OK; pass++) {
        for (i = 0; i < r->num_wanted; i++) {
            mesher__edge_box(r, r->wanted[i], lo, hi);
            n = mesher__grid_buckets(r, lo, hi, buckets);
            if (n == 0) buckets[n++] = r->grid.num_buckets;
            for (j = 0; j < n; j++) {
                if (pass) r->grid.edges[--r->grid.rows[buckets[j]]] = r->wanted[i];
                else r->grid.rows[buckets[j]]++;
            }
            total += n;
        }
        if (pass) break;
        for (i = 1; i < r->grid.num_buckets + 2; i++) r->grid.rows[i] += r->grid.rows[i - 1];
        delaunay_release(r->memory, r->grid.edges);
        r->grid.edges = (uint32_t *)mesher__zeros(r, total, sizeof *r->grid.edges);
    }
    return r->status == MESHER_OK;
}

/* Puts the missing edges of the list that may meet a box into r->near_edges, at most as many as
 * there is room for. Returns their number. */
static uint32_t mesher__near_edges(mesher__recovery *r, const double *lo, const double *hi)
{
    uint32_t buckets[MESHER__GRID_CELLS + 1], n = mesher__grid_buckets(r, lo, hi, buckets),
                                              count = 0, i, j;
    mesher__set_clear(&r->known_near);
    if (n == 0)
        for (i = 0; i < r->num_wanted && count < MESHER__NEAR; i++)
            if (!r->edge_present[r->wanted[i]] &&
                mesher__meets_box(r, r->edges + 2 * (size_t)r->wanted[i], lo, hi))
                r->near_edges[count++] = r->wanted[i];
    if (n == 0) return count;
    buckets[n++] = r->grid.num_buckets;
    for (i = 0; i < n; i++)
        for (j = r->grid.rows[buckets[i]]; j < r->grid.rows[buckets[i] + 1] && count < MESHER__NEAR;
             j++) {
            uint32_t e = r->grid.edges[j];
            if (!r->edge_present[e] && mesher__meets_box(r, r->edges + 2 * (size_t)e, lo, hi) &&
                mesher__add(r, &r->known_near, e))
                r->near_edges[count++] = e;
        }
    return count;
}

/* The sight of a segment from a: two directions across it, about. A facet that lies beside the
 * segment in one of them, by more than rounding, is not crossed: most facets need no predicate. */
typedef struct mesher__sight {
    double a[3], across[2][3], slack[2], size[2], length;
} mesher__sight;

static void mesher__sight_set(const mesher__recovery *r, const uint32_t *ab, mesher__sight *s)
{
    const double *a = mesher__x(r, ab[0]), *b = mesher__x(r, ab[1]);
    double d[3];
    int i, k, axis = 0;
    for (k = 0; k < 3; k++) {
        s->a[k] = a[k];
        d[k] = b[k] - a[k];
        if (fabs(d[k]) < fabs(d[axis])) axis = k;
    }
    s->length = fabs(d[0]) + fabs(d[1]) + fabs(d[2]);
    s->across[0][axis] = 0;
    s->across[0][(axis + 1) % 3] = -d[(axis + 2) % 3];
    s->across[0][(axis + 2) % 3] = d[(axis + 1) % 3];
    for (k = 0; k < 3; k++)
        s->across[1][k] = d[(k + 1) % 3] * s->across[0][(k + 2) % 3] -
                          d[(k + 2) % 3] * s->across[0][(k + 1) % 3];
    for (i = 0; i < 2; i++) {
        const double *u = s->across[i];
        s->size[i] = 1e-14 * (fabs(u[0]) + fabs(u[1]) + fabs(u[2]));
        s->slack[i] = fabs(u[0] * d[0] + u[1] * d[1] + u[2] * d[2]);
    }
}

/* Bits for the sides of the segment on which a point certainly is. The rounding error is below 8 *
 * 2^-53 times the sum of the products; the bound is 90 * 2^-53 times a bound of that sum. */
static unsigned mesher__sight_of(const mesher__sight *s, const double *x)
{
    double d[3], length = s->length;
    unsigned bits = 0;
    int i, k;
    for (k = 0; k < 3; k++) {
        d[k] = x[k] - s->a[k];
        length += fabs(d[k]);
    }
    for (i = 0; i < 2; i++) {
        const double *u = s->across[i];
        double side = u[0] * d[0] + u[1] * d[1] + u[2] * d[2];
        double least = s->slack[i] + s->size[i] * length;
        if (side > least) bits |= 1u << (2 * i);
        if (side < -least) bits |= 2u << (2 * i);
    }
    return bits;
}

/* How many facets a missing edge crosses, of all tetrahedra given by their vertices; a facet of two
 * of them counts twice. */
static long mesher__count_crossings(const mesher__recovery *r, const uint32_t *ab,
                                    const mesher__sight *sight, const uint32_t *tets, size_t count)
{
    long crossings = 0;
    size_t i;
    int k;
    for (i = 0; i < count; i++) {
        const uint32_t *v = tets + 4 * i;
        unsigned at[4];
        for (k = 0; k < 4; k++) at[k] = mesher__sight_of(sight, mesher__x(r, v[k]));
        for (k = 0; k < 4; k++) {
            const uint8_t *o = delaunay_facet_order(k);
            if (at[o[0]] & at[o[1]] & at[o[2]]) continue;
            crossings +=
                delaunay_segment_crosses(r->mesh, ab[0], ab[1], v[o[0]], v[o[1]], v[o[2]], NULL);
        }
    }
    return crossings;
}

/* Twice the number of crossings of the missing edges that the running transaction has removed. The
 * boundary of each replaced polyhedron counts before and after, and cancels out. */
static long mesher__journal_gain(mesher__recovery *r)
{
    size_t end = r->num_journal;
    long gain = 0;
    while (end > 0) {
        uint32_t num_new = r->journal[end - 1], num_old = r->journal[end - 2], n, i;
        const uint32_t *made = r->journal + end - 2 - 4 * (size_t)num_new,
                       *was = made - 4 * (size_t)num_old;
        double lo[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, hi[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
        mesher__grow_box(r, was, 4 * (size_t)num_old, lo, hi);
        n = mesher__near_edges(r, lo, hi);
        r->work += (uint64_t)n * (num_old + num_new);
        for (i = 0; i < n; i++) {
            const uint32_t *ab = r->edges + 2 * (size_t)r->near_edges[i];
            mesher__sight sight;
            mesher__sight_set(r, ab, &sight);
            gain += mesher__count_crossings(r, ab, &sight, was, num_old) -
                    mesher__count_crossings(r, ab, &sight, made, num_new);
        }
        end -= 4 * ((size_t)num_old + num_new) + 2;
    }
    return gain;
}

/* mesher__reduce_edge as a transaction. Returns 2: the edge is in the mesh, 1: the potential fell,
 * 0: nothing changed. */
static int mesher__recover_edge(mesher__recovery *r, uint32_t e, const mesher__effort *effort)
{
    uint32_t missing = r->num_missing_edges;
    int steps = 0, there;
    if (r->edge_present[e]) return 2;
    mesher__begin(r);
    there = mesher__reduce_edge(r, e, effort, &steps);
    if (r->status != MESHER_OK) return 0;
    if (!there && steps > 0 && r->num_missing_edges >= missing && mesher__journal_gain(r) <= 0) {
        mesher__roll_back(r);
        steps = 0;
    }
    r->in_transaction = 0;
    return there ? 2 : steps > 0;
}

/* Lists the missing edges and builds their grid; sorts them by numbers of crossings, the fewest
 * first, if asked for (the number is in the upper half of r->order[i] then). */
static void mesher__list_edges(mesher__recovery *r, int by_crossings)
{
    uint32_t e, i;
    r->num_wanted = 0;
    for (e = 0; e < r->num_edges; e++)
        if (!r->edge_present[e]) r->wanted[r->num_wanted++] = e;
    if (!mesher__grid_build(r) || !by_crossings) return;
    for (i = 0; i < r->num_wanted && !mesher__stopped(r); i++) {
        e = r->wanted[i];
        mesher__walk_edge(r, r->edges[2 * (size_t)e], r->edges[2 * (size_t)e + 1]);
        mesher__report_edge(r, e);
        r->order[i] = (uint64_t)r->pipe.num_crossings << 32 | e;
    }
    if (r->status != MESHER_OK) return;
    for (; i < r->num_wanted; i++) r->order[i] = r->wanted[i]; /* no work was left for these */
    mesher__tell(r, "edges listed", 0);
    if (r->num_wanted > 1) qsort(r->order, r->num_wanted, sizeof *r->order, mesher__compare_u64);
    for (i = 0; i < r->num_wanted; i++) r->wanted[i] = (uint32_t)r->order[i];
}

/* Brings in missing edges by searches over windows of growing size, repeated while that helps. */
static void mesher__edge_levels(mesher__recovery *r)
{
    static const mesher__effort efforts[] = {{7, 200, 1, 4}, {10, 800, 3, 2}, {12, 3000, 2, 2}};
    size_t l;
    uint32_t i;
    int pass;
    for (l = 0; l < sizeof efforts / sizeof *efforts; l++)
        for (pass = 0; pass < efforts[l].passes; pass++) {
            int progress = 0;
            if (r->num_missing_edges == 0 || r->defects) return;
            if (l == 2 && r->num_missing_edges > MESHER__FEW_EDGES) return;
            mesher__list_edges(r, 1);
            if (r->defects) return;
            if (r->by_flips && r->num_missing_edges > MESHER__FEW_EDGES) return;
            for (i = 0; i < r->num_wanted && !mesher__stopped(r); i++) {
                if (r->by_flips && r->order[i] >> 32 > MESHER__LONG_PIPE) break;
                progress |= mesher__recover_edge(r, r->wanted[i], &efforts[l]);
            }
            mesher__tell(r, "edges at level", (int)l);
            if (r->status != MESHER_OK) return;
            if (!progress) break;
        }
}

/* -- facets */

/* Are all three edges of a facet constraints that the mesh has? */
static int mesher__edges_present(const mesher__recovery *r, const uint32_t *f)
{
    int k;
    for (k = 0; k < 3; k++) {
        uint32_t e = mesher__edge_index(r, f[k], f[(k + 1) % 3]);
        if (e == MESHER__ABSENT || !r->edge_present[e]) return 0;
    }
    return 1;
}

/* Searches windows around a missing facet whose pipe is known. Returns the number of commits. */
static uint32_t mesher__reduce_facet(mesher__recovery *r, uint32_t f, const mesher__effort *effort)
{
    mesher__windows_of_facet(r, effort->level, effort->max_points);
    return mesher__try_windows(r, DELAUNAY_FEWER_EDGES, r->facets + 3 * (size_t)f, effort,
                               &r->facet_present[f], 1);
}

/* Brings in a missing facet by searches that lower the number of edges that pierce it; whatever
 * brings one down, the quickest ones may bring down more. 1: it is there. */
static int mesher__recover_facet(mesher__recovery *r, uint32_t f, const mesher__effort *effort)
{
    static const mesher__effort quick = {9, 1000, -1, 1};
    int i;
    for (i = 0; i < 400 && !r->facet_present[f] && !mesher__stopped(r); i++) {
        const uint32_t *v = r->facets + 3 * (size_t)f;
        if (!mesher__edges_present(r, v)) return 0;
        mesher__walk_facet(r, v);
        if (r->status != MESHER_OK || mesher__report_facet(r, f)) return 0;
        if (r->pipe.num_edges == 0) return 0;
        if (!mesher__reduce_facet(r, f, &quick) &&
            (effort->level == quick.level || !mesher__reduce_facet(r, f, effort)))
            return r->facet_present[f];
    }
    return r->facet_present[f];
}

static void mesher__list_facets(mesher__recovery *r)
{
    uint32_t f;
    r->num_wanted = 0;
    for (f = 0; f < r->num_facets; f++)
        if (!r->facet_present[f]) r->wanted[r->num_wanted++] = f;
}

static void mesher__facet_levels(mesher__recovery *r)
{
    static const mesher__effort efforts[] = {
        {9, 1000, -1, 1}, {9, 1000, 0, 6}, {14, 6000, 1, 6}, {20, 20000, 2, 6}};
    size_t l;
    uint32_t i;
    int pass;
    for (l = 0; l < sizeof efforts / sizeof *efforts; l++)
        for (pass = 0; pass < efforts[l].passes; pass++) {
            int progress = 0;
            if (r->num_missing_facets == 0 || r->defects) return;
            mesher__list_facets(r);
            for (i = 0; i < r->num_wanted && !mesher__stopped(r); i++)
                progress |= mesher__recover_facet(r, r->wanted[i], &efforts[l]);
            mesher__tell(r, "facets at level", efforts[l].level);
            if (r->status != MESHER_OK) return;
            if (!progress) break;
        }
}

/* ---- >>kernels  where a point sees all of a window ---------------------------------------- */

/* Xorshift. */
static uint32_t mesher__random(mesher__recovery *r)
{
    r->random ^= r->random << 13;
    r->random ^= r->random >> 7;
    r->random ^= r->random << 17;
    return (uint32_t)(r->random >> 32);
}

/* Seidel's linear program in d variables: maximises c.x subject to |x[k]| <= 4 and, for each row a
 * of r->lp[d], a[0] x[0] + .. + a[d - 1] x[d - 1] <= a[d]. The rows are to be in random order.
 * Returns 0 if infeasible. [Seidel 1991] */
static int mesher__linear_program(mesher__recovery *r, int d, int rows, const double *c, double *x)
{
    double (*a)[5] = r->lp[d], (*b)[5] = r->lp[d - 1];
    int i, j, k, p, q, n;
    if (d == 1) {
        double lo = -4, hi = 4;
        for (i = 0; i < rows; i++) {
            double limit = a[i][0] != 0 ? a[i][1] / a[i][0] : 0;
            if (a[i][0] > 1e-13 && limit < hi) hi = limit;
            if (a[i][0] < -1e-13 && limit > lo) lo = limit;
            if (fabs(a[i][0]) <= 1e-13 && a[i][1] < -1e-11) return 0;
        }
        x[0] = c[0] >= 0 ? hi : lo;
        return lo <= hi + 1e-11;
    }
    for (k = 0; k < d; k++) x[k] = c[k] >= 0 ? 4 : -4;
    for (i = 0; i < rows; i++) {
        double sum = 0, cc[4], y[4], f;
        for (k = 0; k < d; k++) sum += a[i][k] * x[k];
        if (sum <= a[i][d] + 1e-11) continue;
        for (p = 0, k = 1; k < d; k++)
            if (fabs(a[i][k]) > fabs(a[i][p])) p = k;
        if (fabs(a[i][p]) < 1e-12) return 0;
        for (n = 0, j = 0; j < i + 2;
             j++, n++) { /* earlier rows and the bounds of x[p], on the plane of row i */
            double row[5] = {0, 0, 0, 0, 0};
            if (j < i) memcpy(row, a[j], sizeof row);
            else {
                row[p] = j == i ? 1 : -1;
                row[d] = 4;
            }
            f = row[p] / a[i][p];
            for (q = 0, k = 0; k < d; k++)
                if (k != p) b[n][q++] = row[k] - f * a[i][k];
            b[n][q] = row[d] - f * a[i][d];
        }
        f = c[p] / a[i][p];
        for (q = 0, k = 0; k < d; k++)
            if (k != p) cc[q++] = c[k] - f * a[i][k];
        if (!mesher__linear_program(r, d - 1, n, cc, y)) return 0;
        sum = a[i][d];
        for (q = 0, k = 0; k < d; k++)
            if (k != p) {
                x[k] = y[q];
                sum -= a[i][k] * y[q++];
            }
        x[p] = sum / a[i][p];
    }
    return 1;
}

/* The mean of the corners of the shell's facets, and the Cholesky factor l of their covariance. 0:
 * they are in one plane. */
static int mesher__whiten(const mesher__recovery *r, double *mean, double (*l)[3])
{
    double m[3][3] = {{0}}, n = 3.0 * r->num_shell, trace, sum;
    uint32_t i;
    int j, k, c;
    for (j = 0; j < 3; j++) mean[j] = 0;
    for (i = 0; i < r->num_shell; i++)
        for (c = 0; c < 3; c++)
            for (j = 0; j < 3; j++) mean[j] += mesher__x(r, r->shell[i][c])[j] / n;
    for (i = 0; i < r->num_shell; i++)
        for (c = 0; c < 3; c++) {
            const double *x = mesher__x(r, r->shell[i][c]);
            for (j = 0; j < 3; j++)
                for (k = 0; k < 3; k++) m[j][k] += (x[j] - mean[j]) * (x[k] - mean[k]) / n;
        }
    trace = m[0][0] + m[1][1] + m[2][2];
    for (j = 0; j < 3; j++)
        for (k = 0; k <= j; k++) {
            sum = m[j][k];
            for (c = 0; c < k; c++) sum -= l[j][c] * l[k][c];
            if (j != k) l[j][k] = sum / l[k][k];
            else if (!(sum > 1e-28 * trace)) return 0;
            else l[j][j] = sqrt(sum);
        }
    return 1;
}

/* Makes the window's boundary the shell. */
static void mesher__shell_of_window(mesher__recovery *r)
{
    const delaunay_window *w = &r->window;
    uint32_t i, k;
    for (i = 0; i < w->num_facets; i++)
        for (k = 0; k < 3; k++) r->shell[i][k] = w->vertices[w->facets[i][k]];
    r->num_shell = w->num_facets;
}

/* Is the point in the kernel of the shell: does it see all facets from within? Exact. */
static int mesher__in_kernel(const mesher__recovery *r, const double *xyz)
{
    uint32_t i;
    for (i = 0; i < r->num_shell; i++)
        if (mesher__facet_side(r, r->shell[i], xyz) >= 0) return 0;
    return 1;
}

/* The point that is farthest inside the planes of the shell's facets, or of those of them that are
 * constraints, in coordinates x with point = mean + l x, |x[k]| <= 4. Returns its depth (its least
 * distance from a plane) in these coordinates, or 0. */
static double mesher__deepest(mesher__recovery *r, const double *mean, double (*l)[3],
                              int constraints, double *out)
{
    double (*a)[5] = r->lp[4], c[4] = {0, 0, 0, 1}, x[4];
    int n = 0, f, i, j, k;
    for (f = 0; f < (int)r->num_shell; f++) {
        double p[3][3], u[3], v[3], normal[3], length = 0;
        if (constraints && r->shell_beyond[f]) continue;
        i = n++;
        for (k = 0; k < 3; k++) {
            const double *y = mesher__x(r, r->shell[f][k]);
            p[k][0] = (y[0] - mean[0]) / l[0][0];
            p[k][1] = (y[1] - mean[1] - l[1][0] * p[k][0]) / l[1][1];
            p[k][2] = (y[2] - mean[2] - l[2][0] * p[k][0] - l[2][1] * p[k][1]) / l[2][2];
        }
        for (j = 0; j < 3; j++) {
            u[j] = p[1][j] - p[0][j];
            v[j] = p[2][j] - p[0][j];
        }
        for (j = 0; j < 3; j++)
            normal[j] = u[(j + 1) % 3] * v[(j + 2) % 3] - u[(j + 2) % 3] * v[(j + 1) % 3];
        for (j = 0; j < 3; j++) length += normal[j] * normal[j];
        length = sqrt(length);
        if (!(length > 1e-300)) return 0;
        a[i][3] = 1;
        a[i][4] = 0;
        for (j = 0; j < 3; j++) {
            a[i][j] = normal[j] / length;
            a[i][4] += a[i][j] * p[0][j];
        }
    }
    for (i = n - 1; i > 0; i--) {
        double row[5];
        j = (int)(mesher__random(r) % (uint32_t)(i + 1));
        memcpy(row, a[i], sizeof row);
        memcpy(a[i], a[j], sizeof row);
        memcpy(a[j], row, sizeof row);
    }
    if (!mesher__linear_program(r, 4, n, c, x) || !(x[3] > 1e-9)) return 0;
    out[0] = mean[0] + l[0][0] * x[0];
    out[1] = mean[1] + l[1][0] * x[0] + l[1][1] * x[1];
    out[2] = mean[2] + l[2][0] * x[0] + l[2][1] * x[1] + l[2][2] * x[2];
    return x[3];
}

/* The deepest point of the kernel of the shell, in coordinates in which the shell is about round.
 * Returns its depth in these coordinates, or 0. */
static double mesher__kernel(mesher__recovery *r, double *out)
{
    double mean[3], l[3][3],
        depth = mesher__whiten(r, mean, l) ? mesher__deepest(r, mean, l, 0, out) : 0;
    return depth > 0 && mesher__in_kernel(r, out) ? depth : 0;
}

/* Appends the tetrahedra between the shell and a new vertex to the *num_new in r->commit. */
static void mesher__star_shell(mesher__recovery *r, uint32_t v, uint32_t *num_new)
{
    uint32_t i;
    for (i = 0; i < r->num_shell; i++, ++*num_new) {
        uint32_t *c = r->commit + 4 * (size_t)*num_new;
        c[0] = r->shell[i][0], c[1] = r->shell[i][2], c[2] = r->shell[i][1], c[3] = v;
    }
    r->added++;
}

/* Adds a vertex; 0: no memory. */
static uint32_t mesher__new_vertex(mesher__recovery *r, const double *xyz)
{
    uint32_t v = delaunay_add_vertex(r->mesh, xyz, DELAUNAY_NO_ID);
    if (!v) r->status = MESHER_ERROR_OUT_OF_MEMORY;
    return v;
}

/* Replaces r->window, whose boundary is the shell, by the tetrahedra between this and a new
 * vertex. */
static int mesher__star_window(mesher__recovery *r, const double *xyz)
{
    uint32_t v = mesher__new_vertex(r, xyz), num_new = 0;
    if (!v) return 0;
    mesher__star_shell(r, v, &num_new);
    if (mesher__commit(r, r->window.tets, r->window.num_tets, r->commit, num_new)) return 1;
    r->added--;
    return 0;
}

/* Commits num_new tetrahedra of r->commit in place of those of r->pool. Vertices that only the old
 * ones have are removed. */
static int mesher__commit_pool(mesher__recovery *r, uint32_t num_new)
{
    uint32_t i, v;
    size_t j;
    int k, done;
    mesher__set_clear(&r->seen);
    r->queue.count = 0;
    for (i = 0; i < 4 * num_new; i++) mesher__add(r, &r->seen, r->commit[i]);
    for (j = 0; j < r->pool.count; j++)
        for (k = 0; k < 4; k++) {
            v = r->mesh->tets[r->pool.items[j]].v[k];
            if (mesher__add(r, &r->seen, v)) mesher__push(r, &r->queue, v);
        }
    done = r->status == MESHER_OK &&
           mesher__commit(r, r->pool.items, r->pool.count, r->commit, num_new);
    for (j = 0; j < r->queue.count && done; j++) r->mesh->vertex_tet[r->queue.items[j]] = 0;
    if (done) r->removed += (uint32_t)r->queue.count;
    return done;
}

/* ---- >>planes  flips within a plane -------------------------------------------------------
 * For a missing edge that crosses nothing but rungs: edges of the mesh in one plane with it, as
 * where the surface triangulates a flat side in another way than the mesh does. The rungs are
 * flipped within the plane. A flip removes the tetrahedra around a rung, and fills the half of
 * their space on either side of the plane again: by tetrahedra between the rung's ends and its
 * link, or, where there is no such filling, around a Steiner point. There is always a place for
 * this: a point of the rung sees all of the half's boundary from within but what lies in the plane,
 * and a point near it, on that side, sees that, too. The point is put as far from the plane as
 * possible, and replaces other Steiner points that are in its way; if points were put nearer and
 * nearer to the plane instead, they would obstruct each other.
 *
 * Rounding bends the planes of a part that was rotated: its vertices are off them by some units in
 * the last place that was kept, and the mesh has flat tetrahedra there. These are removed first,
 * where flips can do that; what is left in the plane is one layer of triangles. The tests whether a
 * vertex lies in the plane, and which way a turn in it goes, allow for rounding. No tetrahedron
 * that the flips make is flat, and all are positive, exactly. The layer is kept whole, all over the
 * plane: no point replaces an edge between vertices of one plane of the surface, even if that edge
 * is not in the surface. */

/* The sign of the turn abc in the plane of the rungs; 0 also where it may be due to rounding. */
static int mesher__plane_turn(const mesher__recovery *r, uint32_t a, uint32_t b, uint32_t c)
{
    const double *x[3];
    double e[3][3], length, most = 0, area = 0;
    int i, j, k;
    x[0] = mesher__x(r, a), x[1] = mesher__x(r, b), x[2] = mesher__x(r, c);
    for (i = 0; i < 3; i++) {
        for (length = 0, k = 0; k < 3; k++) {
            e[i][k] = x[(i + 1) % 3][k] - x[i][k];
            length += e[i][k] * e[i][k];
        }
        if (length > most) most = length;
    }
    for (k = 0; k < 3; k++) {
        i = (k + 1) % 3;
        j = (k + 2) % 3;
        length = e[0][i] * e[1][j] - e[0][j] * e[1][i];
        area += length * length;
    }
    if (area <= r->plane.tolerance * r->plane.tolerance * most) return 0;
    return delaunay_orient3d(mesher__x(r, a), mesher__x(r, b), mesher__x(r, c),
                             mesher__x(r, r->plane.off));
}

/* Do segments ab and cd of the plane cross, in their interiors? */
static int mesher__plane_cross(const mesher__recovery *r, uint32_t a, uint32_t b, uint32_t c,
                               uint32_t d)
{
    return mesher__plane_turn(r, a, b, c) * mesher__plane_turn(r, a, b, d) < 0 &&
           mesher__plane_turn(r, c, d, a) * mesher__plane_turn(r, c, d, b) < 0;
}

/* Sets the plane to that through missing edge ab along pq, if the length of ab x pq, whose square
 * is plane->wide, is larger than that which the present plane was made from. */
static void mesher__plane_through(mesher__recovery *r, uint32_t a, uint32_t b, uint32_t p,
                                  uint32_t q)
{
    mesher__plane *plane = &r->plane;
    const double *xa = mesher__x(r, a), *xb = mesher__x(r, b), *xp = mesher__x(r, p),
                 *xq = mesher__x(r, q);
    double n[3], wide = 0;
    int k, i, j;
    for (k = 0; k < 3; k++) {
        i = (k + 1) % 3;
        j = (k + 2) % 3;
        n[k] = (xb[i] - xa[i]) * (xq[j] - xp[j]) - (xb[j] - xa[j]) * (xq[i] - xp[i]);
        wide += n[k] * n[k];
    }
    if (!(wide > plane->wide)) return;
    plane->wide = wide;
    for (k = 0; k < 3; k++) {
        plane->normal[k] = n[k] / sqrt(wide);
        plane->at[k] = xa[k];
    }
}

/* Is v in the plane, up to rounding? */
static int mesher__in_plane(const mesher__recovery *r, uint32_t v)
{
    const mesher__plane *plane = &r->plane;
    const double *x = mesher__x(r, v);
    double h = 0;
    int k;
    if (v == DELAUNAY_GHOST) return 0;
    for (k = 0; k < 3; k++) h += plane->normal[k] * (x[k] - plane->at[k]);
    return fabs(h) <= plane->tolerance;
}

/* Finds the first rung of missing edge ab, and with it the plane. 0: there is none. */
static int mesher__first_rung(mesher__recovery *r, uint32_t a, uint32_t b)
{
    static const uint8_t pairs[3][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}};
    size_t i;
    int k;
    if (!mesher__list_star(r, a)) return 0;
    for (i = 0; i < r->star.count; i++) {
        delaunay_handle t = r->star.items[i];
        const uint32_t *v = r->mesh->tets[t].v;
        const uint8_t *o = delaunay_facet_order(delaunay_local_index(&r->mesh->tets[t], a));
        if (delaunay_is_ghost(r->mesh, t)) continue;
        for (k = 0; k < 3; k++) {
            uint32_t x = v[o[pairs[k][0]]], y = v[o[pairs[k][1]]];
            mesher__rung *rung = r->plane.rungs;
            if (x == b || y == b) continue;
            r->plane.wide = 0;
            mesher__plane_through(r, a, b, x, y);
            r->plane.off = v[o[pairs[k][2]]];
            if (!(r->plane.wide > 0) || !mesher__in_plane(r, x) ||
                mesher__in_plane(r, r->plane.off) || !mesher__plane_cross(r, a, b, x, y))
                continue;
            rung->p = mesher__plane_turn(r, a, b, x) > 0 ? x : y;
            rung->q = rung->p == x ? y : x;
            rung->t = t;
            rung->stuck = 0;
            r->plane.count = 1;
            return 1;
        }
    }
    return 0;
}

/* The spin of edge pq of tetrahedron t, as mesher__ring_of finds it in a copy. 0: pq is a
 * constraint, has too many tetrahedra, or is on the hull. */
static int mesher__spin_around(mesher__recovery *r, delaunay_handle t, uint32_t p, uint32_t q)
{
    const delaunay_mesh *mesh = r->mesh;
    const delaunay_tet *tet = &mesh->tets[t];
    mesher__spin *s = &r->plane.spin;
    int i = delaunay_local_index(tet, p), j = delaunay_local_index(tet, q);
    const uint8_t *o;
    uint32_t k, next, out;
    delaunay_handle h;
    if (i < 0 || j < 0 || (mesh->flags[t] & DELAUNAY_EDGE_BIT(delaunay_edge_between(i, j))))
        return 0;
    if (delaunay_is_ghost(mesh, t)) return 0;
    o = delaunay_facet_order(i);
    k = o[0] == j ? 0 : o[1] == j ? 1 : 2;
    s->v[0] = tet->v[o[(k + 1) % 3]];
    s->tets[0] = t;
    next = tet->v[o[(k + 2) % 3]];
    out = s->v[0];
    for (s->n = 1; next != s->v[0]; s->n++) {
        if (s->n == MESHER__SPIN) return 0;
        h = mesh->tets[t].n[delaunay_local_index(&mesh->tets[t], out)];
        t = h / 4;
        if (!t || delaunay_is_ghost(mesh, t)) return 0;
        out = next;
        s->v[s->n] = out;
        s->tets[s->n] = t;
        next = mesh->tets[t].v[h % 4];
    }
    r->work += s->n;
    return 1;
}

/* The spin of a rung. */
static int mesher__spin_rung(mesher__recovery *r, mesher__rung *g)
{
    const delaunay_tet *tet = &r->mesh->tets[g->t];
    if (delaunay_is_deleted(r->mesh, g->t) || delaunay_local_index(tet, g->p) < 0 ||
        delaunay_local_index(tet, g->q) < 0)
        g->t = delaunay_find_edge(r->mesh, r->worker, g->p, g->q);
    return g->t && mesher__spin_around(r, g->t, g->p, g->q);
}

/* Finds all rungs of missing edge ab. 0: it crosses something else than rungs, or a vertex or
 * constraint is in the way. */
static int mesher__walk_plane(mesher__recovery *r, uint32_t a, uint32_t b)
{
    const mesher__spin *s = &r->plane.spin;
    uint32_t i, z = 0;
    int side;
    r->plane.count = 0;
    if (!mesher__first_rung(r, a, b)) return 0;
    for (;;) {
        mesher__rung *g = &r->plane.rungs[r->plane.count - 1];
        if (!mesher__spin_rung(r, g)) return 0;
        for (i = 0; i < s->n; i++) {
            z = s->v[i];
            if (z == b) return 1;
            if (mesher__in_plane(r, z) &&
                mesher__plane_turn(r, g->p, g->q, z) == mesher__plane_turn(r, g->p, g->q, b))
                break;
        }
        if (i == s->n || r->plane.count == MESHER__PIPE) return 0;
        side = mesher__plane_turn(r, a, b, z);
        if (side == 0) return 0;
        g[1].p = side > 0 ? z : g->p;
        g[1].q = side > 0 ? g->q : z;
        g[1].t = s->tets[i];
        g[1].stuck = 0;
        mesher__plane_through(r, a, b, g[1].p, g[1].q);
        r->plane.count++;
    }
}

/* The vertices in the plane that are opposite rung i, towards a (before) and towards b (behind). */
static void mesher__rung_ends(const mesher__recovery *r, uint32_t a, uint32_t b, uint32_t i,
                              uint32_t *before, uint32_t *behind)
{
    const mesher__rung *g = &r->plane.rungs[i];
    *before = i == 0 ? a : g[-1].p == g->p ? g[-1].q : g[-1].p;
    *behind = i + 1 == r->plane.count ? b : g[1].p == g->p ? g[1].q : g[1].p;
}

/* The square of the least height of tetrahedron abcd; HUGE_VAL, without further computation, where
 * the height is certainly more than most. */
static double mesher__least_height2(const mesher__recovery *r, uint32_t a, uint32_t b, uint32_t c,
                                    uint32_t d, double most)
{
    const double *o = mesher__x(r, a);
    double e[4][3], n[4][3], volume = 0, longest = 0, area = 0, length;
    int i, j, k, f;
    for (f = 0; f < 3; f++) {
        const double *y = mesher__x(r, f == 0 ? b : f == 1 ? c : d);
        for (length = 0, k = 0; k < 3; k++) {
            e[f][k] = y[k] - o[k];
            length += e[f][k] * e[f][k];
        }
        if (length > longest) longest = length;
    }
    for (f = 0; f < 3; f++)
        for (k = 0; k < 3; k++) {
            i = (k + 1) % 3;
            j = (k + 2) % 3;
            n[f][k] = e[f][i] * e[(f + 1) % 3][j] - e[f][j] * e[(f + 1) % 3][i];
        }
    for (k = 0; k < 3; k++) volume += n[0][k] * e[2][k];
    volume *= volume;
    if (volume > 16 * most * most * longest * longest) return HUGE_VAL; /* |n| <= 4 longest */
    for (k = 0; k < 3; k++) n[3][k] = n[0][k] + n[1][k] + n[2][k];
    for (f = 0; f < 4; f++) {
        for (length = 0, k = 0; k < 3; k++) length += n[f][k] * n[f][k];
        if (length > area) area = length;
    }
    return area > 0 ? volume / area : 0;
}

/* Is tetrahedron abcd flat: is one of its vertices in the plane of the others, up to rounding? */
static int mesher__is_flat(const mesher__recovery *r, uint32_t a, uint32_t b, uint32_t c,
                           uint32_t d)
{
    const double tolerance = r->plane.tolerance;
    return mesher__least_height2(r, a, b, c, d, tolerance) <= tolerance * tolerance;
}

enum { MESHER__HINGES = 4096 }; /* edges of the surface in the sample, about */

/* Samples edges of the surface by a hash, and enters the corners of facets opposite them into
 * r->order: the edge's hash, and the corner as 3 * facet + place. Returns their number. */
static uint32_t mesher__list_hinges(mesher__recovery *r)
{
    const uint32_t stride = 1 + r->num_facets / MESHER__HINGES;
    const size_t room = (size_t)r->num_edges + r->num_facets;
    uint32_t f, k, n = 0;
    for (f = 0; f < r->num_facets; f++)
        for (k = 0; k < 3 && n < room; k++) {
            const uint32_t *v = r->facets + 3 * (size_t)f;
            uint64_t hash = mesher__mix(mesher__pair(v[(k + 1) % 3], v[(k + 2) % 3])) >> 16;
            if ((hash & UINT32_MAX) % stride == 0) r->order[n++] = hash << 32 | (3 * f + k);
        }
    if (n > 1) qsort(r->order, n, sizeof *r->order, mesher__compare_u64);
    return n;
}

/* A safe estimate of how far rounding has taken vertices off the planes of the surface: eight times
 * the median of the heights by which pairs of neighbouring facets are bent, of those that are
 * hardly bent. A part that was rotated in doubles is bent by their last place; one that was written
 * with fewer digits, or in single precision, by more. */
static double mesher__bend(mesher__recovery *r)
{
    const double least = r->plane.tolerance, most = least * (1 << 29), greatest = least * (1 << 26);
    uint32_t i, n = mesher__list_hinges(r), count = 0;
    double bend;
    for (i = 0; i + 1 < n; i++) {
        uint32_t c = (uint32_t)r->order[i], d = (uint32_t)r->order[i + 1];
        const uint32_t *v = r->facets + c / 3 * (size_t)3, *w = r->facets + d / 3 * (size_t)3;
        uint32_t a = v[(c + 1) % 3], b = v[(c + 2) % 3];
        if (r->order[i] >> 32 != r->order[i + 1] >> 32) continue;
        if (mesher__pair(a, b) != mesher__pair(w[(d + 1) % 3], w[(d + 2) % 3])) continue;
        bend = mesher__least_height2(r, a, b, v[c % 3], w[d % 3], most);
        if (bend <= most * most) memcpy(&r->order[count++], &bend, sizeof bend); /* count <= i */
    }
    if (count == 0) return least;
    qsort(r->order, count, sizeof *r->order, mesher__compare_u64); /* as doubles, which are >= 0 */
    memcpy(&bend, &r->order[count / 2], sizeof bend);
    bend = 8 * sqrt(bend);
    return bend < least ? least : bend > greatest ? greatest : bend;
}

/* Fills the half of the spin of edge pq that has the m vertices of h without pq: appends tetrahedra
 * to r->commit, with as few flat ones as possible; flat: how many there may be. 0: impossible. */
static int mesher__fill_half(mesher__recovery *r, uint32_t p, uint32_t q, const uint32_t *h,
                             uint32_t m, uint32_t flat, uint32_t *num_new)
{
    uint8_t (*apex)[MESHER__HALF] = r->plane.apex, (*cost)[MESHER__HALF] = r->plane.cost;
    uint32_t stack[MESHER__HALF][2], n = 0, i, j, k, width;
    if (m > MESHER__HALF || *num_new + 2 * (m - 2) > DELAUNAY_WINDOW_FACETS) return 0;
    for (i = 0; i + 1 < m; i++) cost[i][i + 1] = 0;
    for (width = 2; width < m; width++)
        for (i = 0; i + width < m; i++) {
            j = i + width;
            cost[i][j] = UINT8_MAX; /* no triangulation */
            for (k = i + 1; k < j && cost[i][j]; k++) {
                uint32_t sum = (uint32_t)cost[i][k] + cost[k][j];
                if (sum > flat || sum >= cost[i][j]) continue;
                r->work += 2;
                if (delaunay_orient3d(mesher__x(r, p), mesher__x(r, h[i]), mesher__x(r, h[k]),
                                      mesher__x(r, h[j])) <= 0 ||
                    delaunay_orient3d(mesher__x(r, q), mesher__x(r, h[i]), mesher__x(r, h[k]),
                                      mesher__x(r, h[j])) >= 0)
                    continue;
                sum += (uint32_t)mesher__is_flat(r, p, h[i], h[k], h[j]) +
                       (uint32_t)mesher__is_flat(r, q, h[i], h[j], h[k]);
                if (sum > flat || sum >= cost[i][j]) continue;
                cost[i][j] = (uint8_t)sum;
                apex[i][j] = (uint8_t)k;
            }
        }
    if (cost[0][m - 1] == UINT8_MAX) return 0;
    stack[n][0] = 0;
    stack[n++][1] = m - 1;
    while (n > 0) {
        uint32_t *c = r->commit + 4 * (size_t)*num_new;
        i = stack[--n][0];
        j = stack[n][1];
        if (j == i + 1) continue;
        k = apex[i][j];
        c[0] = p, c[1] = h[i], c[2] = h[k], c[3] = h[j];
        c[4] = q, c[5] = h[i], c[6] = h[j], c[7] = h[k];
        *num_new += 2;
        stack[n][0] = i;
        stack[n++][1] = k;
        stack[n][0] = k;
        stack[n++][1] = j;
    }
    return 1;
}

/* Where chord h[0] h[m-1] of a half crosses its edge pq, about. */
static void mesher__foot(const mesher__recovery *r, uint32_t p, uint32_t q, const uint32_t *h,
                         uint32_t m, double *foot)
{
    const double *xp = mesher__x(r, p), *xq = mesher__x(r, q), *x0 = mesher__x(r, h[0]),
                 *x1 = mesher__x(r, h[m - 1]);
    double u[3], v[3], t = 0, most = 0;
    int k, i, j;
    for (k = 0; k < 3; k++) {
        u[k] = xq[k] - xp[k];
        v[k] = x1[k] - x0[k];
    }
    for (k = 0; k < 3; k++) { /* use the largest component of the normal */
        double n;
        i = (k + 1) % 3;
        j = (k + 2) % 3;
        n = u[i] * v[j] - u[j] * v[i];
        if (fabs(n) <= fabs(most)) continue;
        most = n;
        t = ((x0[i] - xp[i]) * v[j] - (x0[j] - xp[j]) * v[i]) / n;
    }
    for (k = 0; k < 3; k++) foot[k] = xp[k] + t * u[k];
}

static uint32_t mesher__root(uint32_t *parent, uint32_t v)
{
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
}

/* The smaller root becomes the parent of the larger one. */
static void mesher__join(uint32_t *parent, uint32_t a, uint32_t b)
{
    a = mesher__root(parent, a);
    b = mesher__root(parent, b);
    if (a < b) parent[b] = a;
    else parent[a] = b;
}

/* Joins neighbouring facets that are in one plane, up to rounding. */
static void mesher__join_patches(mesher__recovery *r, uint32_t *parent)
{
    uint32_t f, k, *last; /* of each edge: the last facet seen that has it, + 1 */
    last = mesher__numbers(r, 0, r->domain->num_edges);
    for (f = 0; f < r->domain->num_facets && last; f++) {
        const uint32_t *v = r->facets + 3 * (size_t)f;
        for (parent[f] = f, k = 0; k < 3; k++) {
            const uint32_t a = v[k == 0], b = v[k == 2 ? 1 : 2]; /* in ascending order, like v */
            uint32_t *other = last + r->edge_index[mesher__edge_place(r, a, b)];
            if (*other) {
                const uint32_t *w = r->facets + 3 * (size_t)(*other - 1);
                if (mesher__is_flat(r, a, b, w[0] ^ w[1] ^ w[2] ^ a ^ b, v[k]))
                    mesher__join(parent, *other - 1, f);
            }
            *other = f + 1;
        }
    }
    delaunay_release(r->memory, last);
}

/* Computes the planes of the patches. */
static void mesher__fit_patches(mesher__recovery *r, uint32_t *parent)
{
    const uint32_t n = r->domain->num_facets;
    uint32_t f;
    int k;
    double *plane, length, side, m[3];
    for (f = 0; f < n; f++) { /* sum the facets' normals, all turned to one side */
        const double *a = mesher__x(r, r->facets[3 * (size_t)f]),
                     *b = mesher__x(r, r->facets[3 * (size_t)f + 1]),
                     *c = mesher__x(r, r->facets[3 * (size_t)f + 2]);
        plane = r->patch_planes + 4 * (size_t)mesher__root(parent, f);
        mesher__normal(a, b, c, m);
        for (side = 0, k = 0; k < 3; k++) side += m[k] * plane[k];
        for (k = 0; k < 3; k++) plane[k] += side < 0 ? -m[k] : m[k];
    }
    for (f = 0; f < n; f++) {
        const double *a = mesher__x(r, r->facets[3 * (size_t)f]);
        plane = r->patch_planes + 4 * (size_t)f;
        length = sqrt(plane[0] * plane[0] + plane[1] * plane[1] + plane[2] * plane[2]);
        for (k = 0; k < 3 && length > 0; k++) plane[k] /= length;
        plane[3] = plane[0] * a[0] + plane[1] * a[1] + plane[2] * a[2];
    }
}

/* Enters the patches into the rows of their vertices, in ascending order, or, if rows is NULL, only
 * counts them. next: of each facet the next one of its patch; the first one is its number. */
static void mesher__enter_patches(const mesher__recovery *r, const uint32_t *parent,
                                  const uint32_t *next, uint32_t *last, uint32_t *end,
                                  uint32_t *rows)
{
    const uint32_t n = r->domain->num_facets;
    uint32_t patch, f, k;
    memset(last, 0, r->num_rows * sizeof *last);
    for (patch = 0; patch < n; patch++)
        for (f = parent[patch] == patch ? patch : MESHER__ABSENT; f != MESHER__ABSENT; f = next[f])
            for (k = 0; k < 3; k++) {
                const uint32_t v = r->facets[3 * (size_t)f + k];
                if (last[v] == patch + 1) continue; /* it is there already */
                last[v] = patch + 1;
                if (rows) rows[end[v]] = patch;
                end[v]++;
            }
}

/* Lists the patches by vertices. */
static void mesher__list_patches(mesher__recovery *r, uint32_t *parent)
{
    const uint32_t n = r->domain->num_facets;
    uint32_t *next = mesher__numbers(r, n, 0), *last = mesher__numbers(r, r->num_rows, 0), f, v;
    r->patch_row = mesher__numbers(r, 0, (size_t)r->num_rows + 1);
    for (f = 0; f < n && next; f++) next[f] = MESHER__ABSENT;
    for (f = n; f-- > 0 && next;) {
        const uint32_t patch = parent[f] = mesher__root(parent, f);
        if (patch == f) continue;
        next[f] = next[patch];
        next[patch] = f;
    }
    if (r->status == MESHER_OK) {
        mesher__enter_patches(r, parent, next, last, r->patch_row + 1, NULL);
        for (v = 0; v < r->num_rows; v++) r->patch_row[v + 1] += r->patch_row[v];
        r->patches = mesher__numbers(r, r->patch_row[r->num_rows], 1);
    }
    if (r->status == MESHER_OK) {
        mesher__enter_patches(r, parent, next, last, r->patch_row, r->patches);
        for (v = r->num_rows; v > 0; v--) r->patch_row[v] = r->patch_row[v - 1];
        r->patch_row[0] = 0; /* each was where the next one begins */
    }
    delaunay_release(r->memory, next);
    delaunay_release(r->memory, last);
}

/* Finds the patches, and lists them by vertices. 0: no memory. */
static int mesher__find_patches(mesher__recovery *r)
{
    const size_t n = r->domain->num_facets;
    uint32_t *parent = mesher__numbers(r, n, 0);
    r->patch_planes = (double *)mesher__zeros(r, 4 * n, sizeof *r->patch_planes);
    if (r->status == MESHER_OK) mesher__join_patches(r, parent);
    if (r->status == MESHER_OK) {
        mesher__fit_patches(r, parent);
        mesher__list_patches(r, parent);
    }
    delaunay_release(r->memory, parent);
    return r->status == MESHER_OK;
}

/* Is v in the plane of a patch? */
static int mesher__is_on_patch(const mesher__recovery *r, uint32_t patch, uint32_t v)
{
    const double *x = mesher__x(r, v), *plane = r->patch_planes + 4 * (size_t)patch;
    return fabs(plane[0] * x[0] + plane[1] * x[1] + plane[2] * x[2] - plane[3]) <=
           4 * r->plane.tolerance;
}

/* Is v in the plane of a patch that has u? */
static int mesher__in_plane_of(const mesher__recovery *r, uint32_t u, uint32_t v)
{
    uint32_t i;
    for (i = r->patch_row[u]; i < r->patch_row[u + 1]; i++)
        if (mesher__is_on_patch(r, r->patches[i], v)) return 1;
    return 0;
}

/* Are two vertices of the input in the plane of a patch that has one of them? */
static int mesher__same_patch(const mesher__recovery *r, uint32_t u, uint32_t v)
{
    return u < r->num_rows && v < r->num_rows && mesher__id(r, u) < r->domain->first_corner &&
           mesher__id(r, v) < r->domain->first_corner &&
           (mesher__in_plane_of(r, u, v) || mesher__in_plane_of(r, v, u));
}

/* Does each pair of a triangle's vertices pass mesher__same_patch? */
static int mesher__in_patch(const mesher__recovery *r, uint32_t a, uint32_t b, uint32_t c)
{
    return mesher__same_patch(r, a, b) && mesher__same_patch(r, b, c) &&
           mesher__same_patch(r, c, a);
}

/* The cave is the set of tetrahedra that a new point is to replace, in r->star. Makes its boundary
 * the shell, in the plane with edge pq flipped to chord h[0] h[m-1]. Constrained facets, and facets
 * in patches, are boundary even within the cave. 0: too large. */
static int mesher__cave_shell(mesher__recovery *r, uint32_t p, uint32_t q, const uint32_t *h,
                              uint32_t m)
{
    size_t i;
    int k, c;
    r->num_shell = 2;
    r->shell_beyond[0] = r->shell_beyond[1] = 0;
    r->shell[0][0] = p, r->shell[0][1] = h[0], r->shell[0][2] = h[m - 1];
    r->shell[1][0] = q, r->shell[1][1] = h[m - 1], r->shell[1][2] = h[0];
    for (i = 0; i < r->star.count; i++) {
        delaunay_handle t = r->star.items[i];
        const delaunay_tet *tet = &r->mesh->tets[t];
        for (k = 0; k < 4; k++) {
            delaunay_handle beyond = tet->n[k] / 4;
            uint32_t *v = r->shell[r->num_shell];
            if (r->num_shell == DELAUNAY_WINDOW_FACETS) return 0;
            for (c = 0; c < 3; c++) v[c] = tet->v[delaunay_facet_order(k)[c]];
            if ((v[0] == p || v[1] == p || v[2] == p) && (v[0] == q || v[1] == q || v[2] == q))
                continue;
            if ((r->mesh->flags[t] & DELAUNAY_FACET_BIT(k)) ||
                mesher__in_patch(r, v[0], v[1], v[2]))
                beyond = 0;
            else if (mesher__set_has(&r->known, beyond)) continue;
            r->shell_beyond[r->num_shell++] = beyond;
        }
    }
    return 1;
}

/* Adds the tetrahedra behind those facets of the shell that x does not see to the cave. Returns 1:
 * it has grown, 0: x sees all facets, -1: something that has to stay is in the way. */
static int mesher__cave_grow(mesher__recovery *r, const double *x)
{
    uint32_t i;
    int grown = 0;
    r->work += r->num_shell;
    for (i = 0; i < r->num_shell; i++) {
        delaunay_handle t = r->shell_beyond[i];
        if (mesher__facet_side(r, r->shell[i], x) < 0) continue;
        if (!t || delaunay_is_ghost(r->mesh, t) || mesher__set_has(&r->known_near, t) ||
            r->star.count == MESHER__CAVE)
            return -1;
        if (!mesher__add(r, &r->known, t)) continue;
        mesher__push(r, &r->star, t);
        if (r->status != MESHER_OK) return -1;
        grown = 1;
    }
    return grown;
}

/* May what is inside the cave vanish? Vertices only if they are Steiner points; edges only if they
 * are neither constrained nor in the plane of a patch, except pq. */
static int mesher__cave_is_free(mesher__recovery *r, uint32_t p, uint32_t q)
{
    size_t i;
    int k;
    uint32_t j;
    mesher__set_clear(&r->seen);
    mesher__set_clear(&r->seen_edges);
    for (j = 0; j < r->num_shell; j++)
        for (k = 0; k < 3; k++) {
            mesher__add(r, &r->seen, r->shell[j][k]);
            mesher__add(r, &r->seen_edges,
                        mesher__pair(r->shell[j][k], r->shell[j][(k + 1) % 3]));
        }
    for (i = 0; i < r->star.count; i++) {
        delaunay_handle t = r->star.items[i];
        const uint32_t *v = r->mesh->tets[t].v;
        for (k = 0; k < 4; k++)
            if (v[k] < r->num_rows && !mesher__set_has(&r->seen, v[k])) return 0;
        for (k = 0; k < 6; k++) {
            uint32_t a = v[delaunay_edge_order(k)[0]], b = v[delaunay_edge_order(k)[1]];
            if (((r->mesh->flags[t] & DELAUNAY_EDGE_BIT(k)) || mesher__same_patch(r, a, b)) &&
                mesher__pair(a, b) != mesher__pair(p, q) &&
                !mesher__set_has(&r->seen_edges, mesher__pair(a, b)))
                return 0;
        }
    }
    return r->status == MESHER_OK;
}

/* Starts the cave with the tetrahedra of a half. */
static int mesher__cave_start(mesher__recovery *r, const delaunay_handle *tets, uint32_t count)
{
    uint32_t i;
    r->star.count = 0;
    mesher__set_clear(&r->known);
    for (i = 0; i < count; i++) {
        mesher__add(r, &r->known, tets[i]);
        mesher__push(r, &r->star, tets[i]);
    }
    return r->status == MESHER_OK;
}

/* Adds a vertex at x, if no tetrahedron between it and the shell is flat; else returns 0. */
static uint32_t mesher__cave_vertex(mesher__recovery *r, const double *x)
{
    uint32_t v = mesher__new_vertex(r, x), i;
    for (i = 0; v && i < r->num_shell; i++)
        if (mesher__is_flat(r, r->shell[i][0], r->shell[i][1], r->shell[i][2], v)) {
            r->mesh->num_vertices--;
            return 0;
        }
    return v;
}

/* Fills a half of the spin, the m - 1 tetrahedra with the vertices of h, around a new point, and
 * with it all that is in the way between the half and the point: this is the cave, in r->star. The
 * point is put as far from the plane as possible, as this leaves more room for the next one. */
static int mesher__star_half(mesher__recovery *r, uint32_t p, uint32_t q, const uint32_t *h,
                             uint32_t m, const delaunay_handle *tets, uint32_t *num_new)
{
    const double *xp = mesher__x(r, p), *xq = mesher__x(r, q), *x1 = mesher__x(r, h[1]);
    double foot[3], x[3], deep[3], up = 0, length = 0, t;
    uint32_t v = 0;
    int k, grown;
    mesher__foot(r, p, q, h, m, foot);
    for (k = 0; k < 3; k++) {
        up += r->plane.normal[k] * (x1[k] - foot[k]);
        length += (xq[k] - xp[k]) * (xq[k] - xp[k]);
    }
    length = up > 0 ? sqrt(length) : -sqrt(length);
    for (t = 1; t > 1e-11 && !v && r->status == MESHER_OK; t /= 4) {
        if (!mesher__cave_start(r, tets, m - 1)) return 0;
        for (k = 0; k < 3; k++) x[k] = foot[k] + t * length * r->plane.normal[k];
        do grown = mesher__cave_shell(r, p, q, h, m) ? mesher__cave_grow(r, x) : -1;
        while (grown > 0);
        if (grown < 0 || !mesher__cave_is_free(r, p, q)) continue;
        r->work += 20 * (uint64_t)r->num_shell;
        if (mesher__kernel(r, deep) > 0) v = mesher__cave_vertex(r, deep);
        if (!v) v = mesher__cave_vertex(r, x);
    }
    if (!v || *num_new + r->num_shell > DELAUNAY_WINDOW_FACETS) return 0;
    mesher__star_shell(r, v, num_new);
    return 1;
}

/* The two halves of a rung's spin: the vertices from before to behind, and back, with their
 * tetrahedra. 0: there is nothing to flip, or another vertex around the rung is in the plane. */
static int mesher__halves(mesher__recovery *r, mesher__rung *g, uint32_t before, uint32_t behind,
                          mesher__spin *half)
{
    const mesher__spin *s = &r->plane.spin;
    uint32_t at[2] = {UINT32_MAX, UINT32_MAX}, j, k;
    if (!mesher__spin_rung(r, g)) return 0;
    for (j = 0; j < s->n; j++) {
        if (s->v[j] == before) at[0] = j;
        else if (s->v[j] == behind) at[1] = j;
        else if (mesher__in_plane(r, s->v[j])) return 0;
    }
    if (at[0] == UINT32_MAX || at[1] == UINT32_MAX) return 0;
    for (k = 0; k < 2; k++)
        for (half[k].n = 0, j = at[k];; j = (j + 1) % s->n) {
            half[k].tets[half[k].n] = s->tets[j];
            half[k].v[half[k].n++] = s->v[j];
            if (j == at[1 - k]) break;
        }
    return half[0].n > 2 || half[1].n > 2;
}

/* Fills one half: without a new point or, where this is impossible and points is set, around one.
 * The tetrahedra to be removed are added to r->pool. */
static int mesher__refill(mesher__recovery *r, const mesher__rung *g, const mesher__spin *half,
                          int points, uint32_t *num_new)
{
    uint32_t i;
    size_t j;
    if (mesher__fill_half(r, g->p, g->q, half->v, half->n, 0, num_new)) {
        for (i = 0; i + 1 < half->n; i++) mesher__push(r, &r->pool, half->tets[i]);
        return r->status == MESHER_OK;
    }
    if (!points ||
        !mesher__star_half(r, g->p, g->q, half->v, half->n, half->tets, num_new))
        return 0;
    for (j = 0; j < r->star.count; j++) {
        mesher__push(r, &r->pool, r->star.items[j]);
        mesher__add(r, &r->known_near, r->star.items[j]);
    }
    return r->status == MESHER_OK;
}

/* Flips rung i in the plane; with new points, if points is set. */
static int mesher__flip_rung(mesher__recovery *r, uint32_t i, uint32_t before, uint32_t behind,
                             int points)
{
    mesher__rung *g = &r->plane.rungs[i];
    mesher__spin half[2];
    uint32_t num_new = 0, vertices = r->mesh->num_vertices, added = r->added, j;
    if (!mesher__halves(r, g, before, behind, half)) return 0;
    r->pool.count = 0;
    mesher__set_clear(&r->known_near);
    for (j = 0; j + 1 < half[1].n; j++) mesher__add(r, &r->known_near, half[1].tets[j]);
    if (mesher__refill(r, g, &half[0], points, &num_new)) {
        mesher__set_clear(&r->known_near);
        for (j = 0; j < r->pool.count; j++) mesher__add(r, &r->known_near, r->pool.items[j]);
        if (mesher__refill(r, g, &half[1], points, &num_new) &&
            mesher__commit_pool(r, num_new)) {
            g->t = r->slots[0];
            return 1;
        }
    }
    r->mesh->num_vertices = vertices;
    r->added = added;
    return 0;
}

/* The use of flipping rung i. 2: one rung less, 1: as many rungs, but fewer at vertex target, 0: it
 * cannot be flipped (its surroundings are not convex), or that does not help. */
static int mesher__rung_use(const mesher__recovery *r, uint32_t a, uint32_t b, uint32_t i,
                            uint32_t before, uint32_t behind, uint32_t target)
{
    const mesher__rung *g = &r->plane.rungs[i];
    int one = before == a || behind == b ||
              (g[-1].p == before) == (g[1].p == behind);
    if (!one && g->p != target && g->q != target) return 0;
    if (mesher__plane_turn(r, before, behind, g->p) *
            mesher__plane_turn(r, before, behind, g->q) >= 0)
        return 0;
    return 1 + one;
}

/* The end of a rung that is farthest from missing edge ab, about. */
static uint32_t mesher__farthest(const mesher__recovery *r, uint32_t a, uint32_t b)
{
    const double *x = mesher__x(r, a), *y = mesher__x(r, b);
    double most = -1, u[3], w[3];
    uint32_t i, target = 0;
    int k, side;
    for (k = 0; k < 3; k++) u[k] = y[k] - x[k];
    for (i = 0; i < r->plane.count; i++)
        for (side = 0; side < 2; side++) {
            uint32_t v = side ? r->plane.rungs[i].q : r->plane.rungs[i].p;
            const double *z = mesher__x(r, v);
            double d = 0;
            if (v == target) continue;
            for (k = 0; k < 3; k++) w[k] = z[k] - x[k];
            for (k = 0; k < 3; k++) {
                double c = u[(k + 1) % 3] * w[(k + 2) % 3] - u[(k + 2) % 3] * w[(k + 1) % 3];
                d += c * c;
            }
            if (d <= most) continue;
            most = d;
            target = v;
        }
    return target;
}

/* Is a vertex still an end of a rung? */
static int mesher__at_rung(const mesher__recovery *r, uint32_t v)
{
    uint32_t i;
    for (i = 0; i < r->plane.count; i++)
        if (r->plane.rungs[i].p == v || r->plane.rungs[i].q == v) return 1;
    return 0;
}

/* Flips the first useful rung from *cursor on; with new points, if points is set. 0: none can be
 * flipped. */
static int mesher__plane_step(mesher__recovery *r, uint32_t a, uint32_t b, uint32_t target,
                              int points, uint32_t *cursor)
{
    uint32_t n, i, before, behind;
    mesher__rung *g;
    int use;
    for (n = 0; n < r->plane.count; n++) {
        i = (*cursor + n) % r->plane.count;
        g = &r->plane.rungs[i];
        if (g->stuck && !points) continue;
        mesher__rung_ends(r, a, b, i, &before, &behind);
        use = mesher__rung_use(r, a, b, i, before, behind, target);
        r->work += 2;
        if (!use) continue;
        if (!mesher__flip_rung(r, i, before, behind, points)) {
            if (r->status != MESHER_OK) return 0;
            g->stuck = 1;
            continue;
        }
        if (use == 2) {
            memmove(g, g + 1, (r->plane.count - i - 1) * sizeof *g);
            r->plane.count--;
        } else {
            int left = mesher__plane_turn(r, a, b, before) > 0;
            g->p = left ? before : behind;
            g->q = left ? behind : before;
        }
        if (i > 0) g[-1].stuck = 0;
        if (i + 1 < r->plane.count) g[1].stuck = 0;
        if (i < r->plane.count) g->stuck = 0;
        *cursor = i > 0 ? i - 1 : 0;
        return 1;
    }
    return 0;
}

/* Brings in missing edge e by flips in a plane. Each flip leaves fewer rungs, or as many with fewer
 * of them at vertex target, so the loop terminates. No constraint is removed. */
static void mesher__plane_edge(mesher__recovery *r, uint32_t e)
{
    uint32_t a = r->edges[2 * (size_t)e], b = r->edges[2 * (size_t)e + 1], cursor = 0, target = 0;
    if (!mesher__walk_plane(r, a, b)) return;
    while (r->plane.count > 0 && !mesher__stopped(r)) {
        if (target == 0 || !mesher__at_rung(r, target)) target = mesher__farthest(r, a, b);
        if (!mesher__plane_step(r, a, b, target, 0, &cursor) &&
            !mesher__plane_step(r, a, b, target, 1, &cursor))
            return;
    }
}

/* Does the layer of triangles in a patch's plane stay whole if edge pq is removed? It does if pq is
 * in none, or if the vertices of that plane follow each other around pq without a gap: then only
 * flat tetrahedra are between them. */
static int mesher__plane_stays(const mesher__recovery *r, uint32_t p, uint32_t q)
{
    const mesher__spin *s = &r->plane.spin;
    uint32_t i, runs = 0;
    int in, before;
    if (!mesher__same_patch(r, p, q)) return 1;
    before = mesher__same_patch(r, p, s->v[s->n - 1]) && mesher__same_patch(r, q, s->v[s->n - 1]);
    for (i = 0; i < s->n; i++, before = in) {
        in = mesher__same_patch(r, p, s->v[i]) && mesher__same_patch(r, q, s->v[i]);
        runs += (uint32_t)(in && !before);
    }
    return runs == 1;
}

/* Removes edge pq of tetrahedron t if that leaves fewer flat tetrahedra. Returns how many new ones
 * there are, in r->slots. */
static uint32_t mesher__flatten_edge(mesher__recovery *r, delaunay_handle t, uint32_t p, uint32_t q)
{
    const mesher__spin *s = &r->plane.spin;
    uint32_t i, flat = 0, num_new = 0;
    if (!mesher__spin_around(r, t, p, q) || s->n > MESHER__HALF) return 0;
    for (i = 0; i < s->n; i++)
        flat += (uint32_t)mesher__is_flat(r, p, q, s->v[i], s->v[(i + 1) % s->n]);
    if (flat == 0 || !mesher__plane_stays(r, p, q) ||
        !mesher__fill_half(r, p, q, s->v, s->n, flat - 1, &num_new) ||
        !mesher__commit(r, s->tets, s->n, r->commit, num_new))
        return 0;
    return num_new;
}

/* Flips facet k of flat tetrahedron t to an edge if that leaves fewer flat tetrahedra. Returns how
 * many new ones there are, in r->slots. */
static uint32_t mesher__flatten_facet(mesher__recovery *r, delaunay_handle t, int k)
{
    const delaunay_tet *tet = &r->mesh->tets[t];
    const uint8_t *o = delaunay_facet_order(k);
    delaunay_handle pair[2];
    uint32_t d = tet->v[k], e, i;
    int flat;
    pair[0] = t;
    pair[1] = tet->n[k] / 4;
    if ((r->mesh->flags[t] & DELAUNAY_FACET_BIT(k)) || !pair[1] ||
        delaunay_is_ghost(r->mesh, pair[1]))
        return 0;
    e = r->mesh->tets[pair[1]].v[tet->n[k] % 4];
    if (mesher__in_patch(r, tet->v[o[0]], tet->v[o[1]], tet->v[o[2]]) &&
        !(mesher__in_patch(r, d, tet->v[o[0]], tet->v[o[1]]) &&
          mesher__in_patch(r, d, tet->v[o[1]], tet->v[o[2]])))
        return 0;
    flat = 1 + mesher__is_flat(r, tet->v[o[0]], tet->v[o[1]], tet->v[o[2]], e);
    for (i = 0; i < 3; i++) {
        uint32_t *c = r->commit + 4 * (size_t)i;
        c[0] = d, c[1] = tet->v[o[i]], c[2] = tet->v[o[(i + 1) % 3]], c[3] = e;
        r->work++;
        if (delaunay_orient3d(mesher__x(r, d), mesher__x(r, c[1]), mesher__x(r, c[2]),
                              mesher__x(r, e)) <= 0)
            return 0;
        flat -= mesher__is_flat(r, d, c[1], c[2], e);
    }
    return flat > 0 && mesher__commit(r, pair, 2, r->commit, 3) ? 3 : 0;
}

/* Is tetrahedron t there, not a ghost, and flat? */
static int mesher__is_flat_tet(const mesher__recovery *r, delaunay_handle t)
{
    const delaunay_mesh *mesh = r->mesh;
    const uint32_t *v = mesh->tets[t].v;
    return !delaunay_is_deleted(mesh, t) && !delaunay_is_ghost(mesh, t) &&
           mesher__is_flat(r, v[0], v[1], v[2], v[3]);
}

/* Removes flat tetrahedron t by a flip, if there is one. Returns how many new ones there are, in
 * r->slots. */
static uint32_t mesher__flatten_tet(mesher__recovery *r, delaunay_handle t)
{
    uint32_t num_new = 0, v[4];
    int i;
    memcpy(v, r->mesh->tets[t].v, sizeof v);
    for (i = 0; i < 6 && num_new == 0; i++)
        num_new = mesher__flatten_edge(r, t, v[delaunay_edge_order(i)[0]],
                                       v[delaunay_edge_order(i)[1]]);
    for (i = 0; i < 4 && num_new == 0; i++) num_new = mesher__flatten_facet(r, t, i);
    return num_new;
}

/* Is vertex v in a patch? The patches of a vertex, which may be thousands, are in ascending order.
 */
static int mesher__has_patch(const mesher__recovery *r, uint32_t v, uint32_t patch)
{
    uint32_t low = r->patch_row[v], high = r->patch_row[v + 1];
    while (low < high) {
        const uint32_t mid = low + (high - low) / 2;
        if (r->patches[mid] < patch) low = mid + 1;
        else high = mid;
    }
    return low < r->patch_row[v + 1] && r->patches[low] == patch;
}

/* Marks the patches that have both ends of a missing edge. */
static void mesher__find_patches_of_missing(const mesher__recovery *r, uint8_t *of_missing)
{
    uint32_t e, i;
    for (e = 0; e < r->num_edges; e++) {
        uint32_t a = r->edges[2 * (size_t)e], b = r->edges[2 * (size_t)e + 1], swap = a;
        if (r->edge_present[e] || a >= r->num_rows || b >= r->num_rows) continue;
        if (r->patch_row[a + 1] - r->patch_row[a] > r->patch_row[b + 1] - r->patch_row[b]) {
            a = b;
            b = swap;
        }
        for (i = r->patch_row[a]; i < r->patch_row[a + 1]; i++)
            if (mesher__has_patch(r, b, r->patches[i])) of_missing[r->patches[i]] = 1;
    }
}

/* Are all vertices of t in the plane of a marked patch that has one of them? */
static int mesher__in_marked_patch(const mesher__recovery *r, delaunay_handle t,
                                   const uint8_t *marked)
{
    const uint32_t *v = r->mesh->tets[t].v;
    uint32_t i;
    int k, j;
    for (k = 0; k < 4; k++) {
        if (v[k] >= r->num_rows) continue;
        for (i = r->patch_row[v[k]]; i < r->patch_row[v[k] + 1]; i++) {
            if (!marked[r->patches[i]]) continue;
            for (j = 0; j < 4 && mesher__is_on_patch(r, r->patches[i], v[j]); j++) {}
            if (j == 4) return 1;
        }
    }
    return 0;
}

/* Marks the slots of flat tetrahedra in the planes of marked patches; the threads share them. */
static void mesher__find_flat(const mesher__recovery *r, const uint8_t *marked, uint8_t *is_flat,
                              int64_t slots)
{
    int threads = delaunay_threads(&r->domain->options.host);
    int64_t t;
    (void)threads;
    /* Shared: the mesh, read only; each mark is of one thread. */
    MESHER__OMP(omp parallel for schedule(static) num_threads(threads) if(slots > 4096))
    for (t = 1; t < slots; t++)
        is_flat[t] = (uint8_t)(mesher__is_flat_tet(r, (delaunay_handle)t) &&
                               mesher__in_marked_patch(r, (delaunay_handle)t, marked));
}

/* Removes flat tetrahedra where flips can do that, in the patches that have missing edges. A plane
 * of the surface that rounding has bent is one layer of facets then, as one that is not bent.
 * Returns the number of flips. */
static uint32_t mesher__flatten(mesher__recovery *r)
{
    const delaunay_mesh *mesh = r->mesh;
    const delaunay_handle slots = mesh->num_tets;
    uint8_t *maybe = (uint8_t *)mesher__zeros(r, slots, 1); /* of the slots so far: may be flat */
    uint8_t *marked = (uint8_t *)mesher__zeros(r, (size_t)r->domain->num_facets, 1);
    uint32_t before, done = 0, left, i, num_new;
    delaunay_handle t;
    if (r->status == MESHER_OK) {
        mesher__find_patches_of_missing(r, marked);
        mesher__find_flat(r, marked, maybe, (int64_t)slots);
    }
    do {
        before = done;
        left = 0;
        for (t = 1; t < mesh->num_tets && r->status == MESHER_OK; t++) {
            if ((t < slots && !maybe[t]) || !mesher__is_flat_tet(r, t)) continue;
            if (mesher__stopped(r)) break;
            left++;
            num_new = mesher__flatten_tet(r, t);
            done += num_new > 0;
            for (i = 0; i < num_new; i++)
                if (r->slots[i] < slots) maybe[r->slots[i]] = 1;
        }
        mesher__tell(r, "flat tetrahedra", (int)left);
    } while (done > before && !mesher__stopped(r));
    delaunay_release(r->memory, marked);
    delaunay_release(r->memory, maybe);
    return done;
}

/* Enters the missing edges that cross nothing but rungs into r->order, those with the fewest rungs
 * first; only every stride-th missing edge is looked at. Returns their number, or 0 if they have on
 * average fewer than few rungs. */
static uint32_t mesher__list_in_planes(mesher__recovery *r, uint32_t stride, uint32_t few)
{
    uint64_t rungs = 0;
    uint32_t e, n = 0, missing = 0;
    for (e = 0; e < r->num_edges && !mesher__stopped(r); e++) {
        if (r->edge_present[e] || missing++ % stride ||
            !mesher__walk_plane(r, r->edges[2 * (size_t)e], r->edges[2 * (size_t)e + 1]))
            continue;
        rungs += r->plane.count;
        r->order[n++] = (uint64_t)r->plane.count << 32 | e;
    }
    if (n > 1) qsort(r->order, n, sizeof *r->order, mesher__compare_u64);
    return rungs < few * (uint64_t)n ? 0 : n;
}

/* About how many missing edges cross nothing but rungs. */
static uint32_t mesher__num_in_planes(mesher__recovery *r)
{
    const uint32_t stride = 1 + r->num_missing_edges / MESHER__RUNG_SAMPLE;
    return stride * mesher__list_in_planes(r, stride, 0);
}

/* Brings in missing edges that cross nothing but rungs by flips in planes, those with the fewest
 * rungs first, if they have few of them on average, or more. To find the planes takes longer than
 * what else would bring in a few edges, perhaps with one more point. */
static void mesher__plane_levels(mesher__recovery *r, uint32_t few)
{
    const uint32_t stride = 1 + r->num_missing_edges / MESHER__RUNG_SAMPLE;
    uint32_t i, before, n;
    if (!mesher__list_in_planes(r, stride, few)) return;
    n = mesher__list_in_planes(r, 1, few);
    if (!r->domain->options.no_refine && r->num_facets / MESHER__FACETS_IN_PLANES > n) return;
    if (n == 0 || (!r->patches && !mesher__find_patches(r))) return;
    do {
        before = r->num_missing_edges;
        if (mesher__flatten(r)) n = mesher__list_in_planes(r, 1, 0);
        for (i = 0; i < n && !mesher__stopped(r); i++)
            if (!r->edge_present[(uint32_t)r->order[i]])
                mesher__plane_edge(r, (uint32_t)r->order[i]);
        mesher__tell(r, "edges in planes of", (int)n);
        n = mesher__list_in_planes(r, 1, 0);
    } while (n > 0 && r->num_missing_edges < before && !mesher__stopped(r));
}

/* ---- >>points  inside, each where it removes the most crossings; their removal ------------ */

/* The best place for a new point so far, with its window. */
typedef struct mesher__site {
    int      window;
    double   gain, xyz[3];
} mesher__site;

/* The interior faces of a window, each once, by the window's numbers of vertices. */
static uint32_t mesher__interior_faces(const mesher__recovery *r, const delaunay_window *w,
                                       uint8_t (*faces)[3])
{
    uint32_t i, j, n = 0;
    int k, c;
    for (i = 0; i < w->num_tets; i++) {
        const delaunay_tet *t = &r->mesh->tets[w->tets[i]];
        uint8_t local[4];
        for (c = 0; c < 4; c++) {
            for (j = 0; w->vertices[j] != t->v[c]; j++) {}
            local[c] = (uint8_t)j;
        }
        for (k = 0; k < 4; k++) {
            for (j = 0; j < i && w->tets[j] != t->n[k] / 4; j++) {}
            if (j == i) continue; /* on the boundary, or met from the other side */
            for (c = 0; c < 3; c++) faces[n][c] = local[delaunay_facet_order(k)[c]];
            n++;
        }
    }
    return n;
}

/* How many of some faces of a window a missing edge crosses; counting stops at most. at: for each
 * vertex of the window, the sides of the edge that it is on (mesher__sight_of). */
static long mesher__faces_crossed(const mesher__recovery *r, const delaunay_window *w,
                                  const uint32_t *ab, const unsigned *at,
                                  const uint8_t (*faces)[3], uint32_t count, long most)
{
    long crossings = 0;
    uint32_t j;
    for (j = 0; j < count && crossings < most; j++) {
        const uint8_t *f = faces[j];
        if (at[f[0]] & at[f[1]] & at[f[2]]) continue;
        crossings += delaunay_segment_crosses(r->mesh, ab[0], ab[1], w->vertices[f[0]],
                                              w->vertices[f[1]], w->vertices[f[2]], NULL);
    }
    return crossings;
}

/* How often the missing edges in r->near_edges cross interior faces of a window. Edges that do not
 * enter the window leave the list. */
static long mesher__window_crossings(mesher__recovery *r, const delaunay_window *w,
                                     uint32_t *num_near)
{
    uint8_t faces[2 * DELAUNAY_WINDOW_TETS][3];
    uint32_t i, j, n = 0, num_faces = mesher__interior_faces(r, w, faces);
    long all = 0, crossed;
    for (i = 0; i < *num_near; i++) {
        const uint32_t *ab = r->edges + 2 * (size_t)r->near_edges[i];
        unsigned at[DELAUNAY_WINDOW_VERTICES], beside = ~0u;
        uint32_t ends = 0;
        mesher__sight sight;
        mesher__sight_set(r, ab, &sight);
        for (j = 0; j < w->num_vertices; j++) {
            at[j] = mesher__sight_of(&sight, mesher__x(r, w->vertices[j]));
            beside &= at[j];
            ends += w->vertices[j] == ab[0] || w->vertices[j] == ab[1];
        }
        if (beside) continue;
        crossed = mesher__faces_crossed(r, w, ab, at, (const uint8_t (*)[3])faces, num_faces,
                                        LONG_MAX);
        if (!crossed && ends < 2 &&
            !mesher__faces_crossed(r, w, ab, at, w->facets, w->num_facets, 1))
            continue;
        all += crossed;
        r->near_edges[n++] = r->near_edges[i];
    }
    *num_near = n;
    return all;
}

/* The same for the interior faces that starring the window from a point would make; the point takes
 * the place of vertex 0 meanwhile. Counting ends after the missing edge that reaches most. */
static long mesher__star_crossings(mesher__recovery *r, const delaunay_window *w, uint32_t num_near,
                                   const double *xyz, double most)
{
    unsigned at[DELAUNAY_WINDOW_VERTICES], at_star;
    double ghost[3];
    long count = 0;
    uint32_t i, j;
    int k;
    memcpy(ghost, r->mesh->vertices[0].x, sizeof ghost);
    memcpy(r->mesh->vertices[0].x, xyz, sizeof ghost);
    for (i = 0; i < num_near && (double)count < most; i++) {
        const uint32_t *ab = r->edges + 2 * (size_t)r->near_edges[i];
        mesher__sight sight;
        mesher__sight_set(r, ab, &sight);
        at_star = mesher__sight_of(&sight, xyz);
        for (j = 0; j < w->num_vertices; j++)
            at[j] = mesher__sight_of(&sight, mesher__x(r, w->vertices[j])) & at_star;
        for (j = 0; j < w->num_facets; j++)
            for (k = 0; k < 3; k++) {
                uint32_t a = w->facets[j][k], b = w->facets[j][(k + 1) % 3];
                if (a > b || (at[a] & at[b])) continue;
                count += delaunay_segment_crosses(r->mesh, ab[0], ab[1], w->vertices[a],
                                                  w->vertices[b], 0, NULL);
            }
    }
    memcpy(r->mesh->vertices[0].x, ghost, sizeof ghost);
    return count;
}

/* Tries places for a point in the window: the deepest point, and points between it and its foot on
 * missing edge ab, or a little beyond the foot. */
static void mesher__try_sites(mesher__recovery *r, const uint32_t *ab, int window,
                              const double *deep, double depth, uint32_t num_near,
                              mesher__site *best)
{
    static const double along[6] = {1, .5, .1, .02, -.1, -.02};
    const delaunay_window *w = &r->window;
    const double *a = mesher__x(r, ab[0]), *b = mesher__x(r, ab[1]);
    uint32_t all = num_near;
    long old = mesher__window_crossings(r, w, &num_near);
    double t = 0, length = 0, x[3], gain;
    int i, k;
    for (k = 0; k < 3; k++) {
        t += (deep[k] - a[k]) * (b[k] - a[k]);
        length += (b[k] - a[k]) * (b[k] - a[k]);
    }
    t /= length;
    r->work +=
        (uint64_t)all * w->num_facets + (uint64_t)num_near * (4 * w->num_tets + 9 * w->num_facets);
    for (i = 0; i < 6; i++) {
        if (i > 0 && !(t > 0 && t < 1)) return;
        for (k = 0; k < 3; k++) {
            double foot = a[k] + t * (b[k] - a[k]);
            x[k] = i ? foot + along[i] * (deep[k] - foot) : deep[k];
        }
        if (i > 0 && !mesher__in_kernel(r, x)) continue;
        gain = (double)old + (i ? 0 : 0.3) + 0.1 * (depth < 0.999 ? depth : 0.999);
        if (gain <= best->gain) return;
        gain -= (double)mesher__star_crossings(r, w, num_near, x, gain - best->gain);
        if (gain <= best->gain) continue;
        best->gain = gain;
        best->window = window;
        memcpy(best->xyz, x, sizeof x);
    }
}

/* Sets r->window and the shell from a window, if starring this would lose no vertex, no constrained
 * edge and, with keep_facets, no constrained facet; else returns 0. */
static int mesher__clean_window(mesher__recovery *r, const mesher__window *w, int keep_facets)
{
    const delaunay_window *set = &r->window;
    if (!delaunay_window_set(&r->window, r->mesh, r->pool.items + w->first, w->num_tets,
                             DELAUNAY_WINDOW_VERTICES, 1, keep_facets) ||
        set->num_kept_edges || set->interior || set->num_kept_facets)
        return 0;
    mesher__shell_of_window(r);
    return 1;
}

/* How much of the pipe a window holds: crossed faces or, of a facet's pipe, tetrahedra. */
static uint32_t mesher__pipe_share(const mesher__recovery *r, const mesher__window *w, int of_facet)
{
    const mesher__pipe *p = &r->pipe;
    const delaunay_handle *tets = r->pool.items + w->first;
    uint32_t i, j, share = 0, n = of_facet ? p->num_tets : p->num_crossings;
    uint64_t bits = 0;
    for (j = 0; j < w->num_tets; j++) bits |= mesher__tet_bit(tets[j]);
    for (i = 0; i < n; i++) {
        delaunay_handle a = of_facet ? p->tets[i] : p->crossings[i].tets[0];
        delaunay_handle b = of_facet ? a : p->crossings[i].tets[1];
        int found = 0;
        if (~bits & (mesher__tet_bit(a) | mesher__tet_bit(b))) continue;
        for (j = 0; j < w->num_tets; j++) found |= (tets[j] == a) | (tets[j] == b) << 1;
        share += found == 3;
    }
    return share;
}

/* Sorts the windows by their shares of the pipe, the largest first, and drops those without any. */
static void mesher__windows_by_share(mesher__recovery *r, int of_facet)
{
    uint32_t i, n = 0;
    for (i = 0; i < r->num_windows; i++) {
        uint32_t k = (uint32_t)r->window_order[i],
                 share = mesher__pipe_share(r, &r->windows[k], of_facet);
        if (share)
            r->window_order[n++] = (uint64_t)(MESHER__PIPE - share) << 48 | (uint64_t)i << 24 | k;
    }
    r->num_windows = n;
    if (n > 1) qsort(r->window_order, n, sizeof *r->window_order, mesher__compare_u64);
}

/* Window number i in that order. */
static uint32_t mesher__window_at(const mesher__recovery *r, uint32_t i)
{
    return (uint32_t)r->window_order[i] & 0xffffff;
}

/* Adds one interior point for a missing edge whose pipe is known, where it removes the most
 * crossings of all missing edges, if these are no fewer than least. Returns 1, and their number in
 * *gain, if a point was added. */
static int mesher__point_for_edge(mesher__recovery *r, uint32_t e, int level, int keep_facets,
                                  double least, double *gain)
{
    const uint32_t *ab = r->edges + 2 * (size_t)e;
    mesher__site best;
    uint32_t i, tested = 0, most = r->by_flips ? MESHER__SITES_FIRST : MESHER__SITES;
    best.window = -1;
    best.gain = -1e9;
    mesher__windows_of_edge(r, level, DELAUNAY_WINDOW_VERTICES);
    mesher__windows_by_share(r, 0);
    for (i = 0; i < r->num_windows && tested < most && !mesher__stopped(r); i++) {
        const mesher__window *w = &r->windows[mesher__window_at(r, i)];
        if (tested >= (r->by_flips ? MESHER__FEW_SITES : MESHER__MANY_SITES) &&
            best.gain + r->by_flips >= r->pipe.num_crossings)
            break; /* attempts by flips: one crossing may be left */
        double lo[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, hi[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL},
               deep[3], depth;
        if (!mesher__clean_window(r, w, keep_facets)) continue;
        depth = mesher__kernel(r, deep);
        r->work += 10 * (uint64_t)r->window.num_facets;
        if (!(depth > 0)) continue;
        tested++;
        mesher__grow_box(r, r->window.vertices, r->window.num_vertices, lo, hi);
        mesher__try_sites(r, ab, (int)mesher__window_at(r, i), deep, depth,
                          mesher__near_edges(r, lo, hi), &best);
    }
    if (best.window < 0 || r->status != MESHER_OK) return 0;
    *gain = floor(best.gain);
    if (*gain < least) return 0;
    return mesher__clean_window(r, &r->windows[best.window], keep_facets) &&
           mesher__star_window(r, best.xyz);
}

/* Adds one interior point for a missing facet whose pipe is known: in a window with the largest
 * share of the pipe and, of these, where the deepest point is deepest. */
static int mesher__point_for_facet(mesher__recovery *r)
{
    mesher__site best;
    uint32_t i, tested = 0;
    best.window = -1;
    best.gain = -1;
    mesher__windows_of_facet(r, 1, DELAUNAY_WINDOW_VERTICES);
    mesher__windows_by_share(r, 1);
    for (i = 0; i < r->num_windows && tested < MESHER__SITES && !mesher__stopped(r); i++) {
        double share = (double)(MESHER__PIPE - (r->window_order[i] >> 48)), deep[3], depth;
        if (share < best.gain - 1) break;
        if (!mesher__clean_window(r, &r->windows[mesher__window_at(r, i)], 1)) continue;
        depth = mesher__kernel(r, deep);
        if (!(depth > 0)) continue;
        tested++;
        share += depth < 0.999 ? depth : 0.999;
        if (share <= best.gain) continue;
        best.gain = share;
        best.window = (int)mesher__window_at(r, i);
        memcpy(best.xyz, deep, sizeof deep);
    }
    if (best.window < 0 || r->status != MESHER_OK) return 0;
    return mesher__clean_window(r, &r->windows[best.window], 1) &&
           mesher__star_window(r, best.xyz);
}

/* Has a tetrahedron in the pipe of a missing edge, or beside it, changed since the last flips for
 * this edge? */
static int mesher__way_changed(mesher__recovery *r, const uint32_t *v)
{
    const delaunay_mesh *mesh = r->mesh;
    unsigned changed = 0;
    uint32_t i;
    int k;
    mesher__walk_edge(r, v[0], v[1]);
    for (i = 0; i < r->pipe.num_tets && !changed; i++) {
        changed = mesh->mark[r->pipe.tets[i]];
        for (k = 0; k < 4; k++) changed |= mesh->mark[mesh->tets[r->pipe.tets[i]].n[k] / 4];
    }
    return changed != 0;
}

/* Adds interior points for one missing edge while they gain anything, with flips and searches
 * between them. Returns 1 if anything changed. */
static int mesher__points_for_edge(mesher__recovery *r, uint32_t e)
{
    static const mesher__effort after = {10, 1000, 1, 1}, last = {12, 2000, 2, 1};
    const uint32_t *v = r->edges + 2 * (size_t)e;
    int i, changed = 0;
    for (i = 0; i < (r->by_flips ? MESHER__FEW_POINTS : 40) && !mesher__stopped(r); i++) {
        double gain = 0;
        if (r->edge_present[e]) return 1;
        if (r->by_flips && (i > 0 || !r->notes || mesher__way_changed(r, v)) &&
            mesher__recover_by_flips(r, e))
            return 1;
        if (i > 0 && mesher__recover_edge(r, e, &after) == 2) return 1;
        mesher__walk_edge(r, v[0], v[1]);
        if (r->status != MESHER_OK || mesher__report_edge(r, e)) return changed;
        if (r->pipe.too_long || r->pipe.num_crossings == 0) return changed;
        if (r->by_flips && r->pipe.num_crossings > MESHER__LONG_PIPE) return changed;
        if (!(r->by_flips && mesher__point_for_edge(r, e, 5, 1, 1, &gain)) &&
            !mesher__point_for_edge(r, e, 4, 1, -1e9, &gain)) {
            if (r->status != MESHER_OK) return 0;
            if (!mesher__point_for_edge(r, e, 4, 0, -1e9, &gain)) return changed;
        }
        changed = 1;
        if (gain > 0) continue;
        if (mesher__recover_edge(r, e, &last) == 2) return 1;
        r->hopeless[e]++;
        r->vain++;
        return 1;
    }
    return changed;
}

/* Runs the intersection test, once, before hard work: if the surface intersects itself, nothing can
 * help, and the findings say why. */
static void mesher__ask_for_defects(mesher__recovery *r)
{
    mesher_report none;
    mesher_result result;
    if (r->domain->is_checked || r->defects) return;
    r->domain->is_checked = 1;
    memset(&none, 0, sizeof none);
    result = mesher__check_space(r->domain, r->report ? r->report : &none);
    if (result == MESHER_ERROR_SURFACE) r->defects++;
    else if (result != MESHER_OK) r->status = result;
}

/* Rounds of interior points for all missing edges. Returns 1 if anything changed. */
static int mesher__edge_points(mesher__recovery *r)
{
    int round, any = 0;
    uint32_t i;
    for (round = 0; round < 6 && r->num_missing_edges && !r->stuck && !mesher__stopped(r);
         round++) {
        uint32_t before = r->num_missing_edges;
        int changed = 0;
        mesher__list_edges(r, 0);
        r->notes = r->by_flips && !r->domain->options.no_refine;
        for (i = 0; i < r->num_wanted && !mesher__stopped(r); i++)
            if (!r->edge_present[r->wanted[i]] && r->hopeless[r->wanted[i]] < MESHER__HOPELESS)
                changed |= mesher__points_for_edge(r, r->wanted[i]);
        r->notes = 0;
        mesher__forget_changes(r);
        mesher__tell(r, "points for edges, round", round);
        if (r->num_missing_edges && round == (r->num_missing_edges > MESHER__FEW_EDGES ? 1 : 3))
            mesher__ask_for_defects(r);
        if (r->status != MESHER_OK || r->defects) return any;
        if (r->by_flips) mesher__flip_levels(r);
        if (r->by_flips) mesher__flip_ends(r);
        mesher__edge_levels(r);
        any |= changed;
        if (!changed) break;
        r->stuck = (round > 0 || r->num_missing_edges > MESHER__FEW_EDGES) &&
                   4 * (uint64_t)r->num_missing_edges > 3 * (uint64_t)before;
    }
    return any;
}

/* Interior points for missing facets whose edges are there. Returns 1 if one was added. */
static int mesher__facet_points(mesher__recovery *r)
{
    static const mesher__effort after = {14, 3000, 1, 1};
    uint32_t i;
    int any = 0;
    mesher__list_facets(r);
    for (i = 0; i < r->num_wanted && !mesher__stopped(r); i++) {
        const uint32_t *v = r->facets + 3 * (size_t)r->wanted[i];
        if (r->facet_present[r->wanted[i]] || !mesher__edges_present(r, v)) continue;
        mesher__walk_facet(r, v);
        if (r->status != MESHER_OK || mesher__report_facet(r, r->wanted[i])) return any;
        if (r->pipe.num_edges == 0 || !mesher__point_for_facet(r)) continue;
        any = 1;
        mesher__recover_facet(r, r->wanted[i], &after);
    }
    return any;
}

/* Removes a Steiner point, if no constraint has it and a search finds a filling of its star without
 * it. */
static int mesher__remove_point(mesher__recovery *r, uint32_t v, uint32_t max_points,
                                uint32_t max_nodes)
{
    delaunay_window *w = &r->window;
    uint32_t i, local;
    if (!mesher__list_star(r, v) || r->star.count == 0) return 0;
    if (!delaunay_window_set(w, r->mesh, r->star.items, r->star.count, max_points, 1, 1))
        return 0;
    for (local = 0; w->vertices[local] != v; local++) {}
    if (!(w->interior >> local & 1)) return 0;
    for (i = 0; i < w->num_kept_edges; i++) /* a search would use v again, for this constraint */
        if (w->kept_edges[i][0] == local || w->kept_edges[i][1] == local) return 0;
    w->dropped = 1u << local;
    if (!mesher__search_any(r, max_nodes)) return 0;
    if (!mesher__commit(r, w->tets, w->num_tets, r->commit, mesher__take_search(r, 0))) return 0;
    r->mesh->vertex_tet[v] = 0;
    r->removed++;
    return 1;
}

/* Makes the boundary of a vertex's star the shell. 0: it is too large, or (unless held is set) a
 * constrained edge ends at the vertex. */
static int mesher__shell_of_star(mesher__recovery *r, uint32_t v, int held)
{
    size_t i;
    int k;
    r->num_shell = 0;
    if (!mesher__list_star(r, v)) return 0;
    for (i = 0; i < r->star.count; i++) {
        const delaunay_tet *t = &r->mesh->tets[r->star.items[i]];
        int local = delaunay_local_index(t, v);
        const uint8_t *o = delaunay_facet_order(local);
        if (r->num_shell == DELAUNAY_WINDOW_FACETS) return 0;
        for (k = 0; k < 3; k++) {
            if (!held && r->mesh->flags[r->star.items[i]] &
                             DELAUNAY_EDGE_BIT(delaunay_edge_between(local, o[k])))
                return 0;
            r->shell[r->num_shell][k] = t->v[o[k]];
        }
        r->num_shell++;
    }
    return r->num_shell > 0;
}

/* Removes a Steiner point by moving it onto a neighbour that sees all of its star's boundary but
 * the facets that the neighbour is a vertex of. */
static int mesher__collapse_point(mesher__recovery *r, uint32_t v)
{
    const uint32_t (*shell)[3] = (const uint32_t (*)[3])r->shell;
    uint32_t i, j, n;
    if (!mesher__shell_of_star(r, v, 0)) return 0;
    mesher__set_clear(&r->known);
    for (i = 0; i < 3 * r->num_shell && r->status == MESHER_OK; i++) {
        uint32_t u = shell[i / 3][i % 3];
        if (!mesher__add(r, &r->known, u)) continue;
        for (j = n = 0; j < r->num_shell; j++) {
            const uint32_t *f = shell[j];
            if (f[0] == u || f[1] == u || f[2] == u) continue;
            r->work++;
            if (mesher__facet_side(r, f, mesher__x(r, u)) >= 0) break;
            r->commit[4 * n] = f[0];
            r->commit[4 * n + 1] = f[2];
            r->commit[4 * n + 2] = f[1];
            r->commit[4 * n++ + 3] = u;
        }
        if (j < r->num_shell) continue;
        if (!mesher__commit(r, r->star.items, r->star.count, r->commit, n)) return 0;
        r->mesh->vertex_tet[v] = 0;
        r->removed++;
        return 1;
    }
    return 0;
}

/* Removes edges at a Steiner point by flips, which makes its star smaller. 1: some were removed. */
static int mesher__thin_star(mesher__recovery *r, uint32_t v)
{
    mesher__flips *f = r->flips;
    uint32_t cell, last, k;
    size_t i;
    if (!mesher__list_star(r, v) || r->star.count == 0 || r->star.count > MESHER__THIN_STAR)
        return 0;
    mesher__flips_clear(f, r->mesh, v, v); /* edge vv crosses nothing */
    f->budget = MESHER__THIN_BUDGET;
    f->num_tried = 0;
    f->work = 0;
    for (i = 0; i < r->star.count; i++) mesher__cell_of(f, r->star.items[i]);
    last = f->num_cells;
    for (cell = 1; cell < last && !f->full; cell++)
        for (k = 0; k < 4 && !f->cells[cell].gone; k++) {
            uint32_t w = f->cells[cell].v[k], mark = f->num_log;
            if (w == v || !mesher__first_try(f, v, w)) continue;
            mesher__remove_edge(f, cell, v, w, 0, 0, MESHER__THIN_DEPTH);
            if (f->num_log != mark) f->num_tried = 0;
        }
    r->work += f->work;
    mesher__flips_take(r, f, r->flipped);
    return mesher__commit_flips(r, r->flipped);
}

/* Removes a Steiner point, if either way succeeds. */
static int mesher__point_goes(mesher__recovery *r, uint32_t v, uint32_t max_points,
                              uint32_t max_nodes)
{
    return mesher__collapse_point(r, v) || mesher__remove_point(r, v, max_points, max_nodes);
}

/* A hash of the tetrahedra around a vertex; seed tells one purpose from another. */
static uint64_t mesher__star_hash(mesher__recovery *r, uint32_t v, uint64_t seed)
{
    size_t i;
    if (!mesher__list_star(r, v)) return seed;
    for (i = 0; i < r->star.count; i++) {
        const uint32_t *c = r->mesh->tets[r->star.items[i]].v;
        seed += mesher__mix(mesher__mix(c[0]) + mesher__mix(c[1]) + mesher__mix(c[2]) +
                            mesher__mix(c[3]));
    }
    return seed;
}

/* Tries to remove a Steiner point, in this pass of mesher__remove_points. *vain is the hash of the
 * star with which the last attempt failed: the same star fails again. */
static void mesher__try_point(mesher__recovery *r, uint32_t v, int pass, int thin, uint64_t *vain)
{
    const int hard = pass >= 2;
    const uint64_t hash = mesher__star_hash(r, v, 1 + (uint64_t)hard);
    if (hash != *vain) {
        if (mesher__point_goes(r, v, hard ? 24 : 16, hard ? 20000 : 3000)) return;
        *vain = hash;
    }
    if (thin && pass > 0 && mesher__thin_star(r, v)) mesher__point_goes(r, v, 16, 3000);
}

/* Removes Steiner points; returns 1 if one could be removed. It makes more effort where they are in
 * the way of points on the surface (in_way), or where there is no refinement, which would add
 * points anyway. */
static int mesher__remove_points(mesher__recovery *r, int in_way)
{
    const uint32_t start = r->removed, n = r->mesh->num_vertices;
    const int few = in_way || r->domain->options.no_refine;
    uint64_t *vain = (uint64_t *)mesher__zeros(r, n - r->num_rows, sizeof *vain);
    int pass;
    for (pass = 0; pass < (few ? 12 : 4) && vain; pass++) {
        uint32_t before = r->removed, v;
        for (v = n; v-- > r->num_rows && !mesher__stopped(r);)
            if (r->mesh->vertex_tet[v] && !(v < r->cap_at && r->missing_edges_at[v]))
                mesher__try_point(r, v, pass, few, vain + (v - r->num_rows));
        if (r->removed == before && pass > 0) break;
    }
    delaunay_release(r->memory, vain);
    return r->removed > start;
}

/* Removes vertices that the mesh does not have any more from the arrays; the others move up, in
 * order. */
static void mesher__pack_points(mesher__recovery *r)
{
    delaunay_mesh *mesh = r->mesh;
    uint32_t v, n = r->num_rows;
    size_t i;
    int k;
    for (v = r->num_rows; v < mesh->num_vertices; v++) {
        if (!mesh->vertex_tet[v]) continue;
        if (n != v) {
            if (!mesher__list_star(r, v)) return;
            for (i = 0; i < r->star.count; i++)
                for (k = 0; k < 4; k++)
                    if (mesh->tets[r->star.items[i]].v[k] == v)
                        mesh->tets[r->star.items[i]].v[k] = n;
            mesh->vertices[n] = mesh->vertices[v];
            mesh->vertex_id[n] = mesh->vertex_id[v];
            mesh->vertex_tet[n] = mesh->vertex_tet[v];
        }
        n++;
    }
    mesh->num_vertices = n;
}

/* ---- >>splits  points on missing edges and facets, for a while ----------------------------
 * For what is still missing. A split puts a point on a missing edge or facet, which comes in as
 * pieces; then the points are taken off the surface again (suppressed), the last one first. The
 * star of a point is filled again, with the edge or facet whole, by a search over all of the star,
 * or sector by sector, by a search or around a new point within the sector. A sector is a part of
 * the star between constrained facets. [George et al. 2003] */

/* Makes an edge no constraint any more, or a constraint again, which counts as missing then. */
static void mesher__retire_edge(mesher__recovery *r, uint32_t e, int retired)
{
    if (retired) mesher__set_edge_present(r, e, 1);
    r->edge_retired[e] = (uint8_t)retired;
    if (!retired) mesher__set_edge_present(r, e, 0);
}

static void mesher__retire_facet(mesher__recovery *r, uint32_t f, int retired)
{
    if (retired) mesher__set_facet_present(r, f, 1);
    r->facet_retired[f] = (uint8_t)retired;
    if (!retired) mesher__set_facet_present(r, f, 0);
}

/* Adds a constrained edge, and marks it if the mesh has it. */
static void mesher__add_edge_piece(mesher__recovery *r, uint32_t a, uint32_t b, uint32_t origin)
{
    uint32_t e = r->num_edges++, mask = r->max_pieces * 2 - 1, j;
    delaunay_handle t;
    r->edges[2 * (size_t)e] = a < b ? a : b;
    r->edges[2 * (size_t)e + 1] = a < b ? b : a;
    r->edge_origin[e - r->domain->num_edges] = origin;
    for (j = (uint32_t)mesher__mix(mesher__pair(a, b)) & mask; r->edge_slots[j];
         j = (j + 1) & mask) {}
    r->edge_slots[j] = e + 1;
    r->edge_present[e] = 1;
    mesher__set_edge_present(r, e, 0);
    t = delaunay_find_edge(r->mesh, r->worker, a, b);
    if (!t) return;
    mesher__note_failure(r, delaunay_mark_edge(r->mesh, r->worker, t, a, b, 1));
    mesher__set_edge_present(r, e, 1);
}

static void mesher__add_facet_piece(mesher__recovery *r, uint32_t a, uint32_t b, uint32_t c,
                                    uint32_t origin)
{
    uint32_t f = r->num_facets++, mask = r->max_pieces * 2 - 1, j, *v = r->facets + 3 * (size_t)f;
    delaunay_handle h;
    v[0] = a;
    v[1] = b;
    v[2] = c;
    (void)mesher__ascend(v);
    r->facet_origin[f - r->domain->num_facets] = origin;
    for (j = mesher__facet_hash(v) & mask; r->facet_slots[j]; j = (j + 1) & mask) {}
    r->facet_slots[j] = f + 1;
    r->facet_present[f] = 1;
    mesher__set_facet_present(r, f, 0);
    h = delaunay_find_facet(r->mesh, r->worker, a, b, c);
    if (!h) return;
    delaunay_mark_facet(r->mesh, h, 1);
    mesher__set_facet_present(r, f, 1);
}

static uint32_t mesher__facet_root(const mesher__recovery *r, uint32_t f)
{
    return f < r->domain->num_facets ? f : r->facet_origin[f - r->domain->num_facets];
}

/* Appends zeroed elements to an array of count elements. If memory runs out, it stays as it is. */
static void *mesher__widen(mesher__recovery *r, void *old, size_t count, size_t more, size_t size)
{
    void *block = delaunay_grow_zeroed(r->memory, old, count, count + more, size);
    if (!block) r->status = MESHER_ERROR_OUT_OF_MEMORY;
    return block ? block : old;
}

/* Makes room for pieces in all arrays, which few surfaces need. 0: no memory. */
static int mesher__pieces_room(mesher__recovery *r)
{
    const size_t edges = r->num_edges, facets = r->num_facets, both = edges + facets,
                 rows = r->cap_at, wish = MESHER__PIECES_EACH * (size_t)r->num_missing_edges;
    size_t more = MESHER__FEW_PIECES;
    if (r->splits) return 1;
    while (more < wish && more < MESHER__MOST_PIECES) more *= 2;
    r->edges = (uint32_t *)mesher__widen(r, r->edges, 2 * edges, 2 * more, sizeof *r->edges);
    r->facets = (uint32_t *)mesher__widen(r, r->facets, 3 * facets, 3 * more, sizeof *r->facets);
    r->edge_present = (uint8_t *)mesher__widen(r, r->edge_present, edges, more, 1);
    r->facet_present = (uint8_t *)mesher__widen(r, r->facet_present, facets, more, 1);
    r->edge_retired = (uint8_t *)mesher__widen(r, r->edge_retired, edges, more, 1);
    r->facet_retired = (uint8_t *)mesher__widen(r, r->facet_retired, facets, more, 1);
    r->hopeless = (uint8_t *)mesher__widen(r, r->hopeless, edges, more, 1);
    r->missing_edges_at =
        (uint32_t *)mesher__widen(r, r->missing_edges_at, rows, more, sizeof(uint32_t));
    r->missing_facets_at =
        (uint32_t *)mesher__widen(r, r->missing_facets_at, rows, more, sizeof(uint32_t));
    r->wanted = (uint32_t *)mesher__widen(r, r->wanted, both, 2 * more, sizeof *r->wanted);
    r->order = (uint64_t *)mesher__widen(r, r->order, both, 2 * more, sizeof *r->order);
    r->edge_origin = (uint32_t *)mesher__zeros(r, more, sizeof(uint32_t));
    r->facet_origin = (uint32_t *)mesher__zeros(r, more, sizeof(uint32_t));
    r->edge_slots = (uint32_t *)mesher__zeros(r, 2 * more, sizeof(uint32_t));
    r->facet_slots = (uint32_t *)mesher__zeros(r, 2 * more, sizeof(uint32_t));
    r->splits = (mesher__split *)mesher__zeros(r, more / 4, sizeof(mesher__split));
    if (r->status != MESHER_OK) return 0;
    r->max_pieces = (uint32_t)more;
    r->cap_at += r->max_pieces;
    return 1;
}

/* Is there room for one more split? */
static int mesher__split_room(const mesher__recovery *r)
{
    return r->num_splits < r->max_pieces / 4 &&
           r->num_edges + 64 < r->domain->num_edges + r->max_pieces &&
           r->num_facets + 96 < r->domain->num_facets + r->max_pieces &&
           r->mesh->num_vertices + 1 < r->cap_at;
}

/* Lists the facets at an edge that are constraints now in the split; 0: too many. */
static int mesher__facets_of_edge(const mesher__recovery *r, uint32_t e, mesher__split *split)
{
    const uint32_t *v = r->edges + 2 * (size_t)e;
    uint32_t f;
    split->num_facets = 0;
    for (f = 0; f < r->num_facets; f++) {
        const uint32_t *w = r->facets + 3 * (size_t)f;
        if (r->facet_retired[f]) continue;
        if ((w[0] == v[0]) + (w[1] == v[0]) + (w[2] == v[0]) + (w[0] == v[1]) + (w[1] == v[1]) +
                (w[2] == v[1]) <
            2)
            continue;
        if (split->num_facets == 32) return 0;
        split->facets[split->num_facets++] = f;
    }
    return 1;
}

/* The part of edge ab that is in the kernel of the shell, about: from *low to *high along it. 0:
 * none. */
static int mesher__edge_in_kernel(const mesher__recovery *r, uint32_t a, uint32_t b, double *low,
                                  double *high)
{
    uint32_t i;
    *low = 0;
    *high = 1;
    for (i = 0; i < r->num_shell; i++) {
        const uint32_t *f = r->shell[i];
        int a_within = mesher__facet_side(r, f, mesher__x(r, a)) < 0,
            b_within = mesher__facet_side(r, f, mesher__x(r, b)) < 0;
        double where;
        if (a_within && b_within) continue;
        if (!a_within && !b_within) return 0;
        where = mesher__where(r, a, b, f);
        if (a_within && where < *high) *high = where;
        if (b_within && where > *low) *low = where;
    }
    return *low < *high;
}

/* Finds a clean window, and in its kernel a point x for a split of edge ab: as near the edge's
 * middle as the middle half of the edge's part in the kernel comes. Points near the end of an edge
 * would make thin pieces of its facets, and those of these pieces thinner ones, until rounding
 * turns one over. 0: none. */
static int mesher__point_on_edge(mesher__recovery *r, uint32_t a, uint32_t b, double *x)
{
    const double *p = mesher__x(r, a), *q = mesher__x(r, b);
    uint32_t i;
    int k;
    for (i = 0; i < r->num_windows && !mesher__stopped(r); i++) {
        double low, high, length, t = 0.5;
        if (!mesher__clean_window(r, &r->windows[mesher__window_at(r, i)], 1) ||
            !mesher__edge_in_kernel(r, a, b, &low, &high))
            continue;
        length = high - low;
        if (t < low + 0.25 * length) t = low + 0.25 * length;
        if (t > high - 0.25 * length) t = high - 0.25 * length;
        if (r->attempt) t += length * (0.25 * (double)mesher__random(r) / 4294967296.0 - 0.125);
        if (t < MESHER__SPLIT_MARGIN) t = MESHER__SPLIT_MARGIN;
        if (t > 1 - MESHER__SPLIT_MARGIN) t = 1 - MESHER__SPLIT_MARGIN;
        for (k = 0; k < 3; k++) x[k] = p[k] + t * (q[k] - p[k]);
        if (mesher__in_kernel(r, x)) return 1;
    }
    return 0;
}

/* Finds a clean window that has a point in its kernel. */
static int mesher__window_seen_from(mesher__recovery *r, const double *x)
{
    uint32_t i;
    for (i = 0; i < r->num_windows && !mesher__stopped(r); i++)
        if (mesher__clean_window(r, &r->windows[mesher__window_at(r, i)], 1) &&
            mesher__in_kernel(r, x))
            return 1;
    return 0;
}

/* Reduces a long pipe of an edge to the crossings in its middle. */
static void mesher__pipe_middle(mesher__pipe *p)
{
    uint32_t i, j;
    memmove(p->crossings, p->crossings + (p->num_crossings - MESHER__LONG_PIPE) / 2,
            MESHER__LONG_PIPE * sizeof *p->crossings);
    p->num_crossings = MESHER__LONG_PIPE;
    for (p->num_tets = i = 0; i < 2 * MESHER__LONG_PIPE; i++) {
        delaunay_handle t = p->crossings[i / 2].tets[i % 2];
        for (j = 0; j < p->num_tets && p->tets[j] != t; j++) {}
        if (j == p->num_tets) p->tets[p->num_tets++] = t;
    }
}

/* Finds a window, and in it a place for a point on a missing edge whose pipe is known. In a long
 * pipe only in the middle: its halves are shorter, and windows all along it would take longer than
 * both. Attempts by flips try few kinds of windows first: flips bring in most pieces, wherever they
 * end. */
static int mesher__edge_split_point(mesher__recovery *r, uint32_t a, uint32_t b, double *x)
{
    int longer = r->pipe.num_crossings > MESHER__LONG_PIPE, level, found = 0;
    if (longer) mesher__pipe_middle(&r->pipe);
    for (level = longer || r->by_flips ? 5 : 4; level >= 4 && !found; level--) {
        mesher__windows_of_edge(r, level, DELAUNAY_WINDOW_VERTICES);
        mesher__windows_by_share(r, 0);
        found = mesher__point_on_edge(r, a, b, x);
    }
    return found;
}

/* Begins a split, whose edge or facets are set, at the vertex that was just added; returns that. */
static uint32_t mesher__begin_split(mesher__recovery *r)
{
    mesher__split *split = &r->splits[r->num_splits++];
    uint32_t i;
    r->added--;
    split->vertex = r->mesh->num_vertices - 1;
    split->first_edge = r->num_edges;
    split->first_facet = r->num_facets;
    if (split->edge != MESHER__ABSENT) mesher__retire_edge(r, split->edge, 1);
    for (i = 0; i < split->num_facets; i++) mesher__retire_facet(r, split->facets[i], 1);
    return split->vertex;
}

/* Puts a point on a missing edge, and on the facets that have it. */
static int mesher__split_edge(mesher__recovery *r, uint32_t e)
{
    mesher__split *split = &r->splits[r->num_splits];
    uint32_t a = r->edges[2 * (size_t)e], b = r->edges[2 * (size_t)e + 1], s, i, root;
    double x[3];
    if (!mesher__split_room(r)) return 0;
    mesher__walk_edge(r, a, b);
    if (r->status != MESHER_OK || mesher__report_edge(r, e) || !r->pipe.num_crossings) return 0;
    if (!mesher__edge_split_point(r, a, b, x)) return 0;
    if (!mesher__facets_of_edge(r, e, split) || !mesher__star_window(r, x)) return 0;
    split->edge = e;
    s = mesher__begin_split(r);
    root = e < r->domain->num_edges ? e : r->edge_origin[e - r->domain->num_edges];
    mesher__add_edge_piece(r, a, s, root);
    mesher__add_edge_piece(r, b, s, root);
    for (i = 0; i < split->num_facets; i++) {
        const uint32_t *w = r->facets + 3 * (size_t)split->facets[i];
        uint32_t c = w[0] != a && w[0] != b ? w[0] : w[1] != a && w[1] != b ? w[1] : w[2];
        root = mesher__facet_root(r, split->facets[i]);
        mesher__add_edge_piece(r, c, s, root | MESHER__IN_FACET);
        mesher__add_facet_piece(r, a, s, c, root);
        mesher__add_facet_piece(r, b, s, c, root);
    }
    split->end_edge = r->num_edges;
    split->end_facet = r->num_facets;
    return 1;
}

/* Puts a point on a missing facet, where an edge of the mesh pierces it. */
static int mesher__split_facet(mesher__recovery *r, uint32_t f)
{
    mesher__split *split = &r->splits[r->num_splits];
    uint32_t v[3], s, i, root = mesher__facet_root(r, f);
    int done = 0, k;
    memcpy(v, r->facets + 3 * (size_t)f, sizeof v);
    if (!mesher__split_room(r) || !mesher__edges_present(r, v)) return 0;
    mesher__walk_facet(r, v);
    if (r->status != MESHER_OK || mesher__report_facet(r, f)) return 0;
    mesher__windows_of_facet(r, 0, DELAUNAY_WINDOW_VERTICES);
    mesher__windows_by_share(r, 1);
    for (i = 0; i < r->pipe.num_edges && !done; i++) {
        const double *p = mesher__x(r, r->pipe.edges[i][0]), *q = mesher__x(r, r->pipe.edges[i][1]);
        double t = mesher__where(r, r->pipe.edges[i][0], r->pipe.edges[i][1], v), x[3];
        for (k = 0; k < 3; k++) x[k] = p[k] + t * (q[k] - p[k]);
        done = mesher__window_seen_from(r, x) && mesher__star_window(r, x);
    }
    if (!done) return 0;
    split->edge = MESHER__ABSENT;
    split->num_facets = 1;
    split->facets[0] = f;
    s = mesher__begin_split(r);
    for (k = 0; k < 3; k++) mesher__add_edge_piece(r, v[k], s, root | MESHER__IN_FACET);
    for (k = 0; k < 3; k++) mesher__add_facet_piece(r, v[k], v[(k + 1) % 3], s, root);
    split->end_edge = r->num_edges;
    split->end_facet = r->num_facets;
    return 1;
}

/* Moves Steiner points that no constraint has to the deepest points of their stars' kernels, which
 * makes room beside the surface. */
static void mesher__relax_points(mesher__recovery *r)
{
    int round;
    uint32_t v;
    double x[3];
    for (round = 0; round < 3; round++)
        for (v = r->num_rows; v < r->mesh->num_vertices && !mesher__stopped(r); v++) {
            if (!r->mesh->vertex_tet[v] || (v < r->cap_at && r->missing_edges_at[v]) ||
                !mesher__shell_of_star(r, v, 0))
                continue; /* a point on the surface stays, even if all its edges are missing */
            r->work += 20 * (uint64_t)r->num_shell;
            if (mesher__kernel(r, x) > 0) memcpy(r->mesh->vertices[v].x, x, sizeof x);
        }
}

/* The number of missing edges in the course of the rounds of splits. */
typedef struct mesher__course {
    uint32_t last, most;
    int      fell, rises, stays; /* it has fallen by half; rounds in which it rose, stayed */
} mesher__course;

/* Notes the number of edges missing after a round. 1: they will hardly come in. The number may rise
 * for some rounds at first, but not for several in a row after it has fallen by half. */
static int mesher__course_fails(mesher__course *c, uint32_t missing)
{
    c->rises = missing > c->last && c->fell ? c->rises + 1 : 0;
    c->stays = missing == c->last && missing ? c->stays + 1 : 0;
    if (missing > c->most) c->most = missing;
    if (missing <= c->most / 2) c->fell = 1;
    c->last = missing;
    return c->rises == MESHER__SPLIT_RISES || c->stays == MESHER__SPLIT_STAYS;
}

/* Interior points, with the effort of the attempts without flips, for up to `most` missing edges.
 * Returns 1 if anything changed. */
static int mesher__hard_edge_points(mesher__recovery *r, uint32_t most)
{
    int by_flips = r->by_flips, changed;
    if (!r->num_missing_edges || r->num_missing_edges > most) return 0;
    r->by_flips = r->stuck = 0;
    changed = mesher__edge_points(r);
    r->by_flips = by_flips;
    return changed;
}

/* Splits what is missing until all of it is in the mesh, in pieces. */
static void mesher__split_all(mesher__recovery *r)
{
    mesher__course course = {0, 0, 0, 0, 0};
    int round, relaxed = 0, last = 0;
    uint32_t i;
    uint64_t most = 4 * (uint64_t)r->num_missing_edges + 64; /* or splits might never end */
    if (!mesher__pieces_room(r)) return;
    mesher__list_edges(r, 1);
    if (mesher__stopped(r)) return;
    for (i = 0; i < r->num_wanted; i++) most += r->order[i] >> 32;
    for (round = 0; round < 40 && !mesher__stopped(r); round++) {
        int changed = 0;
        if (mesher__ends(r) || !mesher__lacks(r)) return;
        mesher__list_edges(r, 0);
        for (i = 0; i < r->num_wanted && !mesher__stopped(r); i++)
            if (!r->edge_present[r->wanted[i]]) changed |= mesher__split_edge(r, r->wanted[i]);
        if (r->num_missing_edges && r->by_flips) mesher__flip_levels(r);
        if (r->num_missing_edges) mesher__edge_levels(r);
        if (r->num_missing_edges == 0 && !mesher__ends(r)) {
            mesher__facet_levels(r);
            mesher__list_facets(r);
            for (i = 0; i < r->num_wanted && !mesher__stopped(r) && !r->num_missing_edges; i++)
                if (!r->facet_present[r->wanted[i]])
                    changed |= mesher__split_facet(r, r->wanted[i]);
        }
        mesher__tell(r, "split, round", round);
        if (r->by_flips && r->num_missing_edges > most) return;
        if (mesher__course_fails(&course, r->num_missing_edges)) {
            if (last || r->num_missing_edges > MESHER__LAST_EDGES) return;
            memset(&course, 0, sizeof course); /* one of the last splits into two, over and over */
            changed = 0;
            relaxed = 1;
        }
        if (!changed && relaxed) {
            if (last || !mesher__hard_edge_points(r, MESHER__LAST_EDGES)) return;
            last = 1;
        }
        relaxed = !changed; /* make room where Steiner points are in the way, once */
        if (relaxed) mesher__remove_points(r, 1);
        if (relaxed) mesher__relax_points(r);
    }
}

/* The numbers of n vertices in a window under construction, to which they are added if need be; 0:
 * no room. */
static int mesher__window_numbers(delaunay_window *w, const uint32_t *v, int n, uint8_t *numbers)
{
    uint32_t i;
    int k;
    for (k = 0; k < n; k++) {
        for (i = 0; i < w->num_vertices && w->vertices[i] != v[k]; i++) {}
        if (i == DELAUNAY_WINDOW_VERTICES) return 0;
        if (i == w->num_vertices) w->vertices[w->num_vertices++] = v[k];
        numbers[k] = (uint8_t)i;
    }
    return 1;
}

/* Makes the constraints of a window whole again: removes those at the split's point, and adds the
 * edge and its facets, or the facet. */
static int mesher__window_restore(const mesher__recovery *r, delaunay_window *w,
                                  const mesher__split *split)
{
    uint32_t i, n = 0, local;
    for (local = 0; w->vertices[local] != split->vertex; local++) {}
    if (!(w->interior >> local & 1)) return 0;
    w->dropped = 1u << local;
    for (i = 0; i < w->num_kept_edges; i++)
        if (w->kept_edges[i][0] != local && w->kept_edges[i][1] != local)
            memmove(w->kept_edges[n++], w->kept_edges[i], 2);
    w->num_kept_edges = n;
    for (n = 0, i = 0; i < w->num_kept_facets; i++)
        if (w->kept_facets[i][0] != local && w->kept_facets[i][1] != local &&
            w->kept_facets[i][2] != local)
            memmove(w->kept_facets[n++], w->kept_facets[i], 3);
    w->num_kept_facets = n;
    if (split->edge != MESHER__ABSENT) {
        if (w->num_kept_edges == DELAUNAY_WINDOW_KEPT ||
            !mesher__window_numbers(w, r->edges + 2 * (size_t)split->edge, 2,
                                    w->kept_edges[w->num_kept_edges]))
            return 0;
        w->num_kept_edges++;
    }
    for (i = 0; i < split->num_facets; i++) {
        if (w->num_kept_facets == DELAUNAY_WINDOW_KEPT ||
            !mesher__window_numbers(w, r->facets + 3 * (size_t)split->facets[i], 3,
                                    w->kept_facets[w->num_kept_facets]))
            return 0;
        w->num_kept_facets++;
    }
    return 1;
}

/* whole = 1: the pieces stop being constraints, and the whole edge or facet is one again; 0: the
 * reverse. */
static void mesher__switch_split(mesher__recovery *r, const mesher__split *split, int whole)
{
    uint32_t i;
    for (i = split->first_edge; i < split->end_edge; i++) mesher__retire_edge(r, i, whole);
    for (i = split->first_facet; i < split->end_facet; i++) mesher__retire_facet(r, i, whole);
    if (split->edge != MESHER__ABSENT) mesher__retire_edge(r, split->edge, !whole);
    for (i = 0; i < split->num_facets; i++) mesher__retire_facet(r, split->facets[i], !whole);
}

/* Marks a split's edge, which is whole again, in all tetrahedra around it. Its point was on it only
 * up to rounding: the mesh may have had the edge before, beside the point, and have tetrahedra
 * around it outside the cavity. */
static void mesher__mark_whole_edge(mesher__recovery *r, const mesher__split *split)
{
    const uint32_t *ab = r->edges + 2 * (size_t)split->edge;
    delaunay_handle t = delaunay_find_edge(r->mesh, r->worker, ab[0], ab[1]);
    mesher__note_failure(r, t ? delaunay_mark_edge(r->mesh, r->worker, t, ab[0], ab[1], 1)
                              : DELAUNAY_ERROR_INTERNAL);
}

/* Commits num_new tetrahedra of r->commit in place of those of r->star, and ends the split. */
static int mesher__commit_whole(mesher__recovery *r, mesher__split *split, uint32_t num_new)
{
    mesher__switch_split(r, split, 1);
    if (!mesher__commit(r, r->star.items, r->star.count, r->commit, num_new)) {
        mesher__switch_split(r, split, 0);
        mesher__account_new(r, r->star.items, r->star.count);
        return 0;
    }
    r->mesh->vertex_tet[split->vertex] = 0;
    split->undone = 1;
    if (split->edge != MESHER__ABSENT) mesher__mark_whole_edge(r, split);
    return 1;
}

/* Takes the point off the surface by a search over its whole star. */
static int mesher__suppress_by_search(mesher__recovery *r, mesher__split *split, uint32_t max_nodes)
{
    delaunay_window *w = &r->window;
    int found;
    if (!delaunay_window_set(w, r->mesh, r->star.items, r->star.count,
                             DELAUNAY_WINDOW_VERTICES, 1, 1))
        return 0;
    if (!mesher__window_restore(r, w, split)) return 0;
    found = mesher__search_any(r, max_nodes);
    r->work += 3 * (uint64_t)r->search.nodes;
    return found && mesher__commit_whole(r, split, mesher__take_search(r, 0));
}

/* Enters number into sector for all tetrahedra of the star that are reached from tetrahedron first
 * without crossing a constrained facet. */
static void mesher__flood_sector(const mesher__recovery *r, uint32_t vertex, uint32_t first,
                                 uint32_t count, uint32_t number, uint32_t *sector)
{
    uint32_t stack[MESHER__SHELL], n = 0, j;
    int k;
    stack[n++] = first;
    sector[first] = number;
    while (n > 0) {
        uint32_t i = stack[--n];
        delaunay_handle t = r->star.items[i];
        for (k = 0; k < 4; k++) {
            if (r->mesh->tets[t].v[k] == vertex || (r->mesh->flags[t] & DELAUNAY_FACET_BIT(k)))
                continue;
            for (j = 0; j < count && r->star.items[j] != r->mesh->tets[t].n[k] / 4; j++) {}
            if (j == count || sector[j]) continue;
            sector[j] = number;
            stack[n++] = j;
        }
    }
}

/* w: a piece of a facet, at the split's point. Returns the vertex that takes the point's place when
 * the facet is whole; 0: none, as another piece becomes the whole facet. */
static uint32_t mesher__whole_vertex(const mesher__recovery *r, const mesher__split *split,
                                     const uint32_t *w)
{
    const int of_edge = split->edge != MESHER__ABSENT, last = of_edge ? 1 : 2;
    const uint32_t *whole = of_edge ? r->edges + 2 * (size_t)split->edge
                                    : r->facets + 3 * (size_t)split->facets[0];
    int i, k, seen = 0; /* bit i: w has vertex i of the edge or facet */
    for (k = 0; k < 3; k++)
        for (i = 0; i <= last; i++) seen |= (w[k] == whole[i]) << i;
    return seen == (1 << last) - 1 ? whole[last] : 0;
}

/* Is t a tetrahedron of the sector? */
static int mesher__in_sector(const mesher__recovery *r, const uint32_t *sector, uint32_t number,
                             delaunay_handle t)
{
    size_t j;
    for (j = 0; j < r->star.count; j++)
        if (r->star.items[j] == t) return sector[j] == number;
    return 0;
}

/* Makes the boundary of a sector the shell, with the split facets whole. 0: it is too large. */
static int mesher__sector_shell(mesher__recovery *r, const mesher__split *split,
                                const uint32_t *sector, uint32_t number)
{
    uint32_t i, c, *v;
    int k;
    r->num_shell = 0;
    for (i = 0; i < r->star.count; i++) {
        const delaunay_tet *t = &r->mesh->tets[r->star.items[i]];
        if (sector[i] != number) continue;
        for (k = 0; k < 4; k++) {
            int constrained = (r->mesh->flags[r->star.items[i]] & DELAUNAY_FACET_BIT(k)) != 0;
            if (!constrained && mesher__in_sector(r, sector, number, t->n[k] / 4)) continue;
            if (r->num_shell == MESHER__SHELL) return 0;
            v = r->shell[r->num_shell];
            for (c = 0; c < 3; c++) v[c] = t->v[delaunay_facet_order(k)[c]];
            r->shell_beyond[r->num_shell] = constrained ? 0 : t->n[k] / 4;
            if (v[0] == split->vertex || v[1] == split->vertex || v[2] == split->vertex) {
                uint32_t whole = mesher__whole_vertex(r, split, v);
                if (!whole) continue;
                for (c = 0; c < 3; c++)
                    if (v[c] == split->vertex) v[c] = whole;
            }
            r->num_shell++;
        }
    }
    return r->num_shell > 0;
}

/* Adds the tetrahedra behind those facets of a sector that x does not see to it. Returns 0 if there
 * are none, if a constraint is in the way, or if they are too many. */
static int mesher__grow_sector(mesher__recovery *r, uint32_t *sector, uint32_t number,
                               const double *x, size_t most)
{
    size_t before = r->star.count, j;
    uint32_t i;
    for (i = 0; i < r->num_shell; i++) {
        delaunay_handle t = r->shell_beyond[i];
        if (mesher__facet_side(r, r->shell[i], x) < 0) continue;
        if (!t || delaunay_is_ghost(r->mesh, t)) return 0;
        for (j = 0; j < r->star.count && r->star.items[j] != t; j++) {}
        if (j < before || j == most || j == MESHER__SHELL) return 0;
        if (j < r->star.count) continue;
        sector[j] = number;
        mesher__push(r, &r->star, t);
        if (r->status != MESHER_OK) return 0;
    }
    r->work += r->num_shell + r->star.count;
    return r->star.count > before;
}

/* Has a facet of the shell both vertices a and b, which may be equal? */
static int mesher__on_shell(const mesher__recovery *r, uint32_t a, uint32_t b)
{
    uint32_t i;
    for (i = 0; i < r->num_shell; i++) {
        const uint32_t *f = r->shell[i];
        if ((f[0] == a || f[1] == a || f[2] == a) && (f[0] == b || f[1] == b || f[2] == b))
            return 1;
    }
    return 0;
}

/* May what is inside a grown sector vanish? Vertices only if they are Steiner points; constrained
 * edges only if they are at the split's point. */
static int mesher__sector_is_free(const mesher__recovery *r, const mesher__split *split,
                                  const uint32_t *sector, uint32_t number)
{
    size_t i;
    int k;
    for (i = 0; i < r->star.count; i++) {
        const uint32_t *v = r->mesh->tets[r->star.items[i]].v;
        if (sector[i] != number) continue;
        for (k = 0; k < 4; k++)
            if (v[k] < r->num_rows && !mesher__on_shell(r, v[k], v[k])) return 0;
        for (k = 0; k < 6; k++) {
            uint32_t a = v[delaunay_edge_order(k)[0]], b = v[delaunay_edge_order(k)[1]];
            if (!(r->mesh->flags[r->star.items[i]] & DELAUNAY_EDGE_BIT(k)) || a == split->vertex ||
                b == split->vertex)
                continue;
            if (!mesher__on_shell(r, a, b)) return 0;
        }
    }
    return 1;
}

/* A point that sees all of a sector's boundary, about within a distance of the split's point. The
 * sector grows where something that is no constraint is in the way. 0: none. */
static int mesher__point_within(mesher__recovery *r, const mesher__split *split, uint32_t *sector,
                                uint32_t number, double distance, double *x)
{
    const double *s = mesher__x(r, split->vertex);
    double l[3][3] = {{0}};
    size_t most = r->star.count + MESHER__SECTOR_GROWTH;
    int k;
    for (k = 0; k < 3; k++) l[k][k] = distance / 4;
    for (;;) {
        r->work += 20 * (uint64_t)r->num_shell;
        if (mesher__deepest(r, s, l, 0, x) > 0 && mesher__in_kernel(r, x)) return 1;
        if (!(mesher__deepest(r, s, l, 1, x) > 0)) return 0;
        if (!mesher__grow_sector(r, sector, number, x, most)) return 0;
        if (!mesher__sector_shell(r, split, sector, number)) return 0;
    }
}

/* The same, with distances from far to near; what the sector takes in may all vanish. */
static int mesher__grown_point(mesher__recovery *r, const mesher__split *split, uint32_t *sector,
                               uint32_t number, double *x)
{
    const double *s = mesher__x(r, split->vertex);
    double size = 0, deep[3];
    size_t count = r->star.count;
    uint32_t i;
    int k;
    for (i = 0; i < r->num_shell; i++)
        for (k = 0; k < 3; k++) {
            double d = fabs(mesher__x(r, r->shell[i][0])[k] - s[k]);
            if (d > size) size = d;
        }
    for (k = 0; k < 24 && r->status == MESHER_OK; k++, size /= 4) {
        r->star.count = count;
        if (!mesher__sector_shell(r, split, sector, number)) return 0;
        if (!mesher__point_within(r, split, sector, number, size, x)) continue;
        if (!mesher__sector_is_free(r, split, sector, number)) continue;
        if (mesher__kernel(r, deep) > 0) memcpy(x, deep, sizeof deep);
        return 1;
    }
    r->star.count = count;
    return 0;
}

/* Makes a window of the shell, without tetrahedra, for a search; 0: it has too many vertices. */
static int mesher__window_of_shell(mesher__recovery *r)
{
    delaunay_window *w = &r->window;
    uint32_t i;
    w->num_tets = w->num_vertices = w->num_facets = 0;
    w->num_kept_edges = w->num_kept_facets = w->interior = w->dropped = 0;
    for (i = 0; i < r->num_shell; i++, w->num_facets++)
        if (!mesher__window_numbers(w, r->shell[i], 3, w->facets[i])) return 0;
    return 1;
}

/* Fills the shell of a sector: by a search, or around a new point. Appends the tetrahedra to the
 * *num_new in r->commit. */
static int mesher__fill_sector(mesher__recovery *r, const mesher__split *split, uint32_t *sector,
                               uint32_t number, uint32_t *num_new)
{
    uint32_t v;
    double x[3];
    int found = 0;
    if (mesher__window_of_shell(r)) {
        found = mesher__search_any(r, 5000);
        r->work += 3 * (uint64_t)r->search.nodes;
    }
    if (found) {
        if (*num_new + r->search.num_tets > MESHER__SHELL) return 0;
        *num_new += mesher__take_search(r, *num_new);
        return 1;
    }
    if (!(mesher__kernel(r, x) > 0) && !mesher__grown_point(r, split, sector, number, x)) return 0;
    if (*num_new + r->num_shell > MESHER__SHELL) return 0;
    v = mesher__new_vertex(r, x);
    if (!v) return 0;
    mesher__star_shell(r, v, num_new);
    return 1;
}

/* How many vertices r->star has, besides the split's point, that r->commit does not have. */
static uint32_t mesher__points_lost(mesher__recovery *r, const mesher__split *split,
                                    uint32_t num_new)
{
    uint32_t i, lost = 0;
    int k;
    mesher__set_clear(&r->seen);
    mesher__add(r, &r->seen, split->vertex);
    for (i = 0; i < 4 * num_new; i++) mesher__add(r, &r->seen, r->commit[i]);
    for (i = 0; i < r->star.count; i++)
        for (k = 0; k < 4; k++)
            lost += (uint32_t)mesher__add(r, &r->seen, r->mesh->tets[r->star.items[i]].v[k]);
    return lost;
}

/* Takes the point of r->star off the surface by filling its star sector by sector. */
static int mesher__suppress_by_sectors(mesher__recovery *r, mesher__split *split)
{
    uint32_t sector[MESHER__SHELL], i, number = 0, num_new = 0, vertices = r->mesh->num_vertices;
    uint32_t added = r->added, count = (uint32_t)r->star.count;
    if (count > MESHER__SHELL) return 0;
    memset(sector, 0, sizeof sector);
    for (i = 0; i < count; i++) {
        if (sector[i]) continue;
        mesher__flood_sector(r, split->vertex, i, count, ++number, sector);
        if (!mesher__sector_shell(r, split, sector, number)) break;
        if (!mesher__fill_sector(r, split, sector, number, &num_new)) break;
    }
    if (i == count && number > 1) {
        uint32_t lost = mesher__points_lost(r, split, num_new);
        if (mesher__commit_whole(r, split, num_new)) {
            r->removed += lost;
            return 1;
        }
    }
    r->mesh->num_vertices = vertices;
    r->added = added;
    return 0;
}

/* Has a piece that split i made been split again, by one that still stands? */
static int mesher__split_again(const mesher__recovery *r, uint32_t i)
{
    const mesher__split *split = &r->splits[i];
    uint32_t j, k;
    for (j = i + 1; j < r->num_splits; j++) {
        const mesher__split *later = &r->splits[j];
        if (later->undone) continue;
        if (later->edge >= split->first_edge && later->edge < split->end_edge) return 1;
        for (k = 0; k < later->num_facets; k++)
            if (later->facets[k] >= split->first_facet && later->facets[k] < split->end_facet)
                return 1;
    }
    return 0;
}

/* Takes a point off the surface after vertex v, another point on it, has moved to x, which has to
 * be in the kernel of the star of v. If that does not help, v moves back. */
static int mesher__suppress_moved(mesher__recovery *r, mesher__split *split, uint32_t v,
                                  const double *x)
{
    double old[3];
    if (!mesher__shell_of_star(r, v, 1) || !mesher__in_kernel(r, x)) return 0;
    memcpy(old, mesher__x(r, v), sizeof old);
    memcpy(r->mesh->vertices[v].x, x, sizeof old);
    if (mesher__list_star(r, split->vertex) &&
        (mesher__suppress_by_search(r, split, 2000) || mesher__suppress_by_sectors(r, split)))
        return 1;
    memcpy(r->mesh->vertices[v].x, old, sizeof old);
    return 0;
}

/* Takes a point off the surface after Steiner point v has moved to one side of a facet's plane, or
 * to the other. */
static int mesher__suppress_across(mesher__recovery *r, mesher__split *split, uint32_t v,
                                   const uint32_t *facet)
{
    int side, k;
    for (side = 0; side < 2; side++) {
        double x[3];
        if (!mesher__shell_of_star(r, v, 1) || r->num_shell == DELAUNAY_WINDOW_FACETS) return 0;
        for (k = 0; k < 3; k++) r->shell[r->num_shell][k] = facet[side ? 2 - k : k];
        r->num_shell++;
        if (mesher__kernel(r, x) > 0 && mesher__suppress_moved(r, split, v, x)) return 1;
    }
    return 0;
}

/* Between two facets of an edge that lie in one plane up to rounding, as pieces of one facet do,
 * there may be no room when they are whole. Where the rounding is that of a Steiner point, this
 * point is moved. */
static int mesher__suppress_by_moves(mesher__recovery *r, mesher__split *split)
{
    const uint32_t *ab;
    uint32_t i, j;
    int k;
    if (split->edge == MESHER__ABSENT) return 0;
    ab = r->edges + 2 * (size_t)split->edge;
    for (i = 0; i < split->num_facets; i++)
        for (k = 0; k < 3; k++) {
            uint32_t v = r->facets[3 * (size_t)split->facets[i] + (size_t)k];
            if (v == ab[0] || v == ab[1] || v < r->num_rows) continue;
            for (j = 0; j < split->num_facets; j++)
                if (j != i && mesher__suppress_across(r, split, v,
                                                      r->facets + 3 * (size_t)split->facets[j]))
                    return 1;
        }
    return 0;
}

/* Takes one point off the surface, if that is possible; with more effort after the first pass. */
static int mesher__suppress(mesher__recovery *r, mesher__split *split, int pass)
{
    if (!mesher__list_star(r, split->vertex)) return 0;
    if (mesher__suppress_by_search(r, split, 2000) || mesher__suppress_by_sectors(r, split))
        return 1;
    if (pass == 0) return 0;
    return mesher__list_star(r, split->vertex) &&
           (mesher__suppress_by_search(r, split, 50000) || mesher__suppress_by_moves(r, split));
}

/* Takes as many points off the surface as possible, the last one first, in passes; ends early if
 * many points stay and a pass removed none. */
static void mesher__suppress_all(mesher__recovery *r)
{
    uint32_t left = r->num_splits, before, i;
    int pass, changed = 1;
    mesher__relax_points(r);
    for (pass = 0; pass < 12 && left > 0 && (changed || pass < 4); pass++) {
        changed = 0;
        before = left;
        for (i = r->num_splits; i-- > 0 && !mesher__stopped(r);) {
            mesher__split *split = &r->splits[i];
            if (split->undone || mesher__split_again(r, i) || !mesher__suppress(r, split, pass))
                continue;
            changed = 1;
            left--;
        }
        if (left > 0) changed |= mesher__remove_points(r, 1);
        if (left > 0) mesher__relax_points(r);
        mesher__tell(r, "points left on the surface", (int)left);
        if (pass > 0 && left == before && left > MESHER__FEW_EDGES) return;
    }
}

/* How many points were not taken off the surface. */
static uint32_t mesher__points_on_surface(const mesher__recovery *r)
{
    uint32_t i, n = 0;
    for (i = 0; i < r->num_splits; i++) n += !r->splits[i].undone;
    return n;
}

/* ---- >>attempts  the whole recovery ------------------------------------------------------- */

static void mesher__recovery_free(mesher__recovery *r)
{
    delaunay_memory *memory = r->memory;
    mesher__set *sets[5];
    delaunay_list *lists[5];
    int i;
    sets[0] = &r->seen;
    sets[1] = &r->seen_edges;
    sets[2] = &r->known;
    sets[3] = &r->failed;
    sets[4] = &r->known_near;
    lists[0] = &r->queue;
    lists[1] = &r->star;
    lists[2] = &r->pool;
    lists[3] = &r->came;
    lists[4] = &r->touched;
    for (i = 0; i < 5; i++) mesher__set_free(sets[i]);
    for (i = 0; i < 5; i++) delaunay_list_free(lists[i]);
    delaunay_release(memory, r->grid.rows);
    delaunay_release(memory, r->grid.edges);
    delaunay_release(memory, r->edges);
    delaunay_release(memory, r->edge_row);
    delaunay_release(memory, r->edge_other);
    delaunay_release(memory, r->edge_index);
    delaunay_release(memory, r->facets);
    delaunay_release(memory, r->facet_row);
    delaunay_release(memory, r->facet_index);
    delaunay_release(memory, r->facet_second);
    delaunay_release(memory, r->facet_third);
    delaunay_release(memory, r->edge_seen);
    delaunay_release(memory, r->facet_seen);
    delaunay_release(memory, r->edge_present);
    delaunay_release(memory, r->facet_present);
    delaunay_release(memory, r->hopeless);
    delaunay_release(memory, r->edge_retired);
    delaunay_release(memory, r->facet_retired);
    delaunay_release(memory, r->edge_origin);
    delaunay_release(memory, r->facet_origin);
    delaunay_release(memory, r->edge_slots);
    delaunay_release(memory, r->facet_slots);
    delaunay_release(memory, r->splits);
    delaunay_release(memory, r->missing_edges_at);
    delaunay_release(memory, r->missing_facets_at);
    delaunay_release(memory, r->wanted);
    delaunay_release(memory, r->order);
    delaunay_release(memory, r->journal);
    delaunay_release(memory, r->patch_row);
    delaunay_release(memory, r->patches);
    delaunay_release(memory, r->patch_planes);
    delaunay_release(memory, r->flips);
    delaunay_release(memory, r->flipped);
    delaunay_worker_free(r->worker);
    delaunay_release(memory, r);
}

/* How far rounding to doubles may take a vertex off a plane: some units in the last place of the
 * largest coordinate. If coordinates have fewer digits, mesher__bend estimates it. */
static double mesher__rounding(const mesher_domain *domain)
{
    const delaunay_mesh *mesh = &domain->mesh;
    double most = 0;
    uint32_t v;
    int k;
    for (v = 1; v < mesh->num_vertices; v++)
        for (k = 0; k < 3 && mesh->vertex_id[v] < domain->first_corner; k++)
            if (fabs(mesh->vertices[v].x[k]) > most) most = fabs(mesh->vertices[v].x[k]);
    return most * (1.0 / 70368744177664.0);
}

/* Allocates a recovery with all arrays; NULL when out of memory. */
static mesher__recovery *mesher__recovery_new(mesher_domain *domain, mesher_report *report)
{
    delaunay_memory *memory = &domain->memory;
    mesher__recovery *r = (mesher__recovery *)delaunay_alloc(memory, 1, sizeof *r);
    size_t edges = domain->num_edges, facets = domain->num_facets, rows = domain->mesh.num_vertices;
    if (!r) return NULL;
    memset(r, 0, offsetof(mesher__recovery, pipe));
    r->domain = domain;
    r->mesh = &domain->mesh;
    r->report = report;
    r->memory = memory;
    r->num_rows = domain->mesh.num_vertices;
    r->random = 88172645463325252u;
    r->max_work = MESHER__WORK_FIRST;
    r->max_vain = MESHER__VAIN;
    r->seen.memory = r->seen_edges.memory = r->known.memory = r->known_near.memory =
        r->failed.memory = memory;
    r->queue.memory = r->star.memory = r->pool.memory = r->came.memory = r->touched.memory =
        memory;
    mesher__set_clear(&r->failed);
    r->num_edges = domain->num_edges;
    r->num_facets = domain->num_facets;
    r->cap_at = r->num_rows;
    r->edges = mesher__numbers(r, 2 * edges, 0);
    r->edge_row = (uint32_t *)mesher__zeros(r, rows + 1, sizeof(uint32_t));
    r->edge_other = mesher__numbers(r, edges, MESHER__ROW_BLOCK);
    r->edge_index = mesher__numbers(r, edges, 1);
    r->facets = mesher__numbers(r, 3 * facets, 0);
    r->facet_row = (uint32_t *)mesher__zeros(r, rows + 1, sizeof(uint32_t));
    r->facet_index = mesher__numbers(r, facets, 1);
    r->facet_second = mesher__numbers(r, facets, MESHER__ROW_BLOCK);
    r->facet_third = mesher__numbers(r, facets, MESHER__ROW_BLOCK);
    r->edge_seen = (uint8_t *)mesher__zeros(r, edges + 1, 1);
    r->facet_seen = (uint8_t *)mesher__zeros(r, facets, 1);
    r->edge_present = (uint8_t *)mesher__zeros(r, edges, 1);
    r->facet_present = (uint8_t *)mesher__zeros(r, facets, 1);
    r->edge_retired = (uint8_t *)mesher__zeros(r, edges, 1);
    r->facet_retired = (uint8_t *)mesher__zeros(r, facets, 1);
    r->hopeless = (uint8_t *)mesher__zeros(r, edges, 1);
    r->missing_edges_at = (uint32_t *)mesher__zeros(r, rows, sizeof(uint32_t));
    r->missing_facets_at = (uint32_t *)mesher__zeros(r, rows, sizeof(uint32_t));
    r->wanted = mesher__numbers(r, edges + facets, 1);
    r->order = (uint64_t *)mesher__block(r, edges + facets, sizeof *r->order);
    r->flips = (mesher__flips *)mesher__block(r, 1, sizeof *r->flips);
    r->flipped = (mesher__flipped *)mesher__block(r, 1, sizeof *r->flipped);
    if (r->flips) r->flips->epoch = MESHER__UNUSED;
    r->num_flips = r->num_flipped = 1;
    r->crew.host = &domain->options.host;
    r->plane.tolerance = mesher__rounding(domain);
    r->worker = delaunay_worker_new(memory);
    if (r->status != MESHER_OK || !r->worker) {
        mesher__recovery_free(r);
        return NULL;
    }
    return r;
}

/* Runs the intersection test if more edges are missing than the flips so far leave of a valid
 * surface. Returns whether there are defects. */
static int mesher__is_defective(mesher__recovery *r)
{
    if (r->num_missing_edges > MESHER__MANY_EDGES) mesher__ask_for_defects(r);
    return r->defects > 0;
}

/* Brings in edges by searches and, in attempts by flips, by flips before and after, in planes and
 * elsewhere. Flips elsewhere may leave edges that pierce a plane, which hinder those in it: if
 * nearly all that was missing is in planes, the next attempt begins with flips there, however few
 * the rungs. (The end of a fine cylinder is often a fan of its corners, which are on a circle: all
 * of its edges are missing.) */
static void mesher__bring_in_edges(mesher__recovery *r)
{
    const uint32_t first = r->attempt == 1 ? 0 : MESHER__MANY_RUNGS, missing = r->num_missing_edges;
    uint32_t in_planes = 0;
    if (r->by_flips) {
        if (missing > r->num_edges / 64) r->plane.tolerance = mesher__bend(r);
        if (r->attempt == 0) in_planes = mesher__num_in_planes(r);
        mesher__plane_levels(r, first);
        mesher__flip_levels(r);
        if (r->num_missing_edges > r->num_edges / 16 && mesher__is_defective(r)) return;
        mesher__plane_levels(r, MESHER__MANY_RUNGS);
    }
    r->max_vain = MESHER__VAIN + r->num_missing_edges / MESHER__VAIN;
    mesher__edge_levels(r);
    if (r->by_flips) mesher__plane_levels(r, 0);
    r->stuck_in_planes =
        in_planes > missing - missing / 8 && r->num_missing_edges > MESHER__FEW_EDGES;
    if (!r->by_flips || r->stuck_in_planes || r->num_missing_edges <= MESHER__FEW_EDGES) return;
    if (mesher__is_defective(r)) return;
    mesher__flip_ends(r);
    mesher__edge_levels(r);
    mesher__plane_levels(r, 0);
}

/* Brings in edges, then facets, and adds interior points for what is left, over and over. */
static void mesher__recover_all(mesher__recovery *r)
{
    int round;
    uint32_t before;
    mesher__bring_in_edges(r);
    if (mesher__ends(r) || r->stuck_in_planes) return;
    if (r->num_missing_edges > r->num_facets / 32) mesher__ask_for_defects(r);
    before = r->num_missing_edges;
    r->max_work = r->work + MESHER__WORK_THEN;
    for (round = 0; round < 12 && !mesher__stopped(r); round++) {
        int changed = 0;
        if (mesher__ends(r)) return;
        if (r->num_missing_edges) changed |= mesher__edge_points(r);
        if (r->num_missing_facets) mesher__facet_levels(r);
        if (mesher__ends(r)) return;
        if (r->num_missing_edges > MESHER__FEW_EDGES || r->num_missing_facets > MESHER__FEW_FACETS)
            mesher__ask_for_defects(r);
        if (mesher__ends(r)) return;
        if (r->num_missing_facets) changed |= mesher__facet_points(r);
        mesher__tell(r, "points for facets, round", round);
        r->unmoved = r->num_missing_edges > MESHER__FEW_EDGES &&
                     4 * (uint64_t)r->num_missing_edges > 3 * (uint64_t)before;
        if (!mesher__lacks(r) || !changed) return;
    }
}

/* Reports a missing edge or facet, which has count vertices. Of a piece of one, as points on the
 * surface make them, only one vertex of the caller's is told: its own or, if it has none, one of
 * the source's. */
static void mesher__report_piece(mesher__recovery *r, uint32_t source, const uint32_t *v, int count)
{
    uint32_t id[3] = {DELAUNAY_NO_ID, DELAUNAY_NO_ID, DELAUNAY_NO_ID};
    int i, known = 0, first = 0;
    for (i = count; i-- > 0;) {
        id[i] = mesher__id(r, v[i]);
        if (id[i] == DELAUNAY_NO_ID) continue;
        known++;
        first = i;
    }
    if (known == 0) {
        const mesher_surface *s = &r->domain->surface;
        id[first] = source < s->num_triangles ? s->triangles[3 * (size_t)source]
                                              : s->edges[2 * (source - s->num_triangles)];
    }
    if (known < count) {
        id[0] = id[first];
        id[1] = id[2] = DELAUNAY_NO_ID;
    }
    mesher_report_add(r->report, MESHER_DEFECT_RECOVERY, source, DELAUNAY_NO_ID, id[0], id[1],
                      id[2], mesher__x(r, v[first]));
}

/* One finding for each edge and facet that is still missing. */
static void mesher__report_missing(mesher__recovery *r)
{
    uint32_t i;
    for (i = 0; i < r->num_edges; i++)
        if (!r->edge_present[i])
            mesher__report_piece(r, mesher__edge_source(r, i), r->edges + 2 * (size_t)i, 2);
    for (i = 0; i < r->num_facets; i++) {
        const uint32_t *v = r->facets + 3 * (size_t)i;
        if (r->facet_present[i] || !mesher__edges_present(r, v)) continue;
        mesher__report_piece(r, mesher__facet_source(r, i), v, 3);
    }
    if (r->report)
        snprintf(
            r->report->message, sizeof r->report->message,
            "%lu edges and %lu facets of the surface could not be recovered, and no defect of it "
            "explains why",
            (unsigned long)r->num_missing_edges, (unsigned long)r->num_missing_facets);
}

/* Reports the points that could not be taken off the surface: as notes where they are allowed, else
 * as a failure. */
static mesher_result mesher__report_splits(mesher__recovery *r)
{
    int allowed = r->domain->options.allow_surface_steiner;
    uint32_t i;
    for (i = 0; i < r->num_splits; i++) {
        const mesher__split *split = &r->splits[i];
        int of_edge = split->edge != MESHER__ABSENT;
        uint32_t source = of_edge ? mesher__edge_source(r, split->edge)
                                  : mesher__facet_source(r, split->facets[0]);
        if (split->undone) continue;
        mesher_report_add(r->report, allowed ? MESHER_NOTE_SURFACE_STEINER : MESHER_DEFECT_RECOVERY,
                          source, DELAUNAY_NO_ID, DELAUNAY_NO_ID, DELAUNAY_NO_ID, DELAUNAY_NO_ID,
                          mesher__x(r, split->vertex));
    }
    r->domain->surface_steiner = mesher__points_on_surface(r);
    if (r->report) r->report->surface_steiner = r->domain->surface_steiner;
    if (r->report && !allowed)
        snprintf(
            r->report->message, sizeof r->report->message,
            "%lu points would have to stay on the surface, which allow_surface_steiner permits",
            (unsigned long)r->domain->surface_steiner);
    return allowed ? MESHER_OK : MESHER_ERROR_RECOVERY;
}

/* Is so little missing that points on the surface may help? In later attempts they are tried
 * anyway. */
static int mesher__worth_splits(const mesher__recovery *r)
{
    return !r->by_flips || r->num_missing_edges <= MESHER__FEW_SPLITS;
}

/* Brings in what is missing, if need be by points on the surface, which are then taken off it. If
 * that fails, asks for defects. In the last attempt by flips, long edges get interior points first:
 * splits of edges that cross hundreds of others in one plane make ever smaller pieces of them. */
static void mesher__bring_in(mesher__recovery *r)
{
    mesher__recover_all(r);
    if (r->stuck_in_planes) return;
    r->max_vain = UINT32_MAX;
    if (r->by_flips && r->attempt == MESHER__FLIP_ATTEMPTS - 1 && !mesher__ends(r))
        mesher__hard_edge_points(r, MESHER__FEW_SPLITS);
    if (!mesher__ends(r) && mesher__worth_splits(r) && mesher__lacks(r)) {
        mesher__split_all(r);
        if (!mesher__ends(r) && !mesher__lacks(r)) mesher__suppress_all(r);
    }
    if (!mesher__ends(r) && mesher__lacks(r)) mesher__ask_for_defects(r);
}

/* Removes the points that recovery has added, where it can, and moves the others to better
 * places. */
static void mesher__clear_points(mesher__recovery *r)
{
    if (!mesher__ends(r) && !mesher__lacks(r)) {
        mesher__remove_points(r, 0);
        mesher__relax_points(r);
        if (mesher__remove_points(r, 0)) mesher__relax_points(r);
    }
    mesher__tell(r, "points removed, now", (int)(r->added - r->removed));
}

/* Is another attempt by flips of little use: have points brought in hardly an edge, and splits not
 * nearly all that was left? */
static int mesher__flips_are_vain(const mesher__recovery *r)
{
    return r->unmoved && (!r->num_splits || r->num_missing_edges > MESHER__FEW_EDGES);
}

/* What an attempt has led to; *again as for mesher__recover_once. If it has failed and there is no
 * other one to make, reports why. */
static mesher_result mesher__outcome(mesher__recovery *r, int attempt, int *again)
{
    int worthwhile = r->by_flips ? r->work < r->max_work : r->work < MESHER__WORK_FIRST;
    if (r->status != MESHER_OK) return r->status;
    if (r->defects) {
        if (r->report) mesher__message_finish(r->report);
        return MESHER_ERROR_SURFACE;
    }
    if (r->stuck_in_planes) {
        *again = 1;
        return MESHER_OK;
    }
    if (!mesher__lacks(r) && !mesher__points_on_surface(r)) return MESHER_OK;
    if (worthwhile && attempt < MESHER__ATTEMPTS - 1) {
        *again = r->by_flips && mesher__flips_are_vain(r) ? MESHER__FLIP_ATTEMPTS - attempt : 1;
        return MESHER_OK;
    }
    if (!mesher__lacks(r)) return mesher__report_splits(r);
    mesher__report_missing(r);
    return MESHER_ERROR_RECOVERY;
}

/* One attempt on the empty mesh. *again is 0: this was the last one; n: it failed, nothing is
 * reported, and attempt + n should be made next (where flips are in vain, the first of those
 * without). */
static mesher_result mesher__recover_once(mesher_domain *domain, mesher_report *report, int attempt,
                                          int *again)
{
    mesher__recovery *r = mesher__recovery_new(domain, report);
    mesher_result result;
    double start;
    *again = 0;
    if (!r) return MESHER_ERROR_OUT_OF_MEMORY;
    r->by_flips = attempt < MESHER__FLIP_ATTEMPTS;
    r->attempt = r->by_flips ? attempt : attempt - MESHER__FLIP_ATTEMPTS;
    r->random += 2 * (uint64_t)r->attempt;
    mesher__do_both(r, mesher__build_edge_rows, mesher__build_facet_rows);
    start = delaunay_seconds(&domain->options.host);
    mesher__detect(r);
    if (report) {
        report->seconds_detect = delaunay_seconds(&domain->options.host) - start;
        report->missing_edges = r->num_missing_edges;
        report->missing_facets = r->num_missing_facets;
    }
    mesher__bring_in(r);
    mesher__clear_points(r);
    result = mesher__outcome(r, attempt, again);
    if (r->status == MESHER_OK) mesher__pack_points(r); /* findings use the old numbers */
    if (r->status != MESHER_OK) result = r->status;
    if (report) report->interior_steiner = r->added - r->removed;
    mesher__recovery_free(r);
    return result;
}

MESHER_API mesher_result mesher_recover(mesher_domain *domain, mesher_report *report)
{
    double start, empty, again_empty = 0;
    mesher_result result;
    int again, attempt = 0;
    if (!mesher__enter(report, domain && domain->stage == MESHER__STAGE_EMPTY))
        return MESHER_ERROR_INVALID_ARGUMENT;
    empty = report ? report->seconds_empty : 0;
    start = delaunay_seconds(&domain->options.host);
    while ((result = mesher__recover_once(domain, report, attempt, &again)) == MESHER_OK && again) {
        delaunay_mesh_free(&domain->mesh);
        domain->stage = MESHER__STAGE_INIT;
        result = mesher_empty_mesh(domain, report);
        if (result != MESHER_OK) break;
        if (report) again_empty += report->seconds_empty;
        attempt += again;
    }
    if (report) { /* the empty meshes that were made again do not count as recovery */
        report->seconds_empty = empty + again_empty;
        report->seconds_recover = delaunay_seconds(&domain->options.host) - start - again_empty;
    }
    domain->stage = result == MESHER_OK ? MESHER__STAGE_RECOVERED : MESHER__STAGE_FAILED;
    return result;
}

/* ---- >>regions ---------------------------------------------------------------------------- */

/* A cell: all tetrahedra that can be reached from each other through facets that are not
 * constrained. Cell 0 is the outside. */
typedef struct mesher__cell {
    uint64_t key;      /* the least 2*source + side of its facets; cells are sorted by it */
    uint32_t facet;    /* its first facet: the one that has this key */
    uint64_t num_tets;
    double   volume;
} mesher__cell;

/* A facet by the numbers that its vertices have in the mesh. Those with the same smallest vertex
 * form a row. */
typedef struct mesher__wall {
    uint32_t v[3];   /* ascending */
    uint32_t facet;
    uint32_t odd;    /* the source triangle is an odd permutation of v */
} mesher__wall;

/* Scratch of mesher_color. */
typedef struct mesher__coloring {
    uint32_t *first; /* facets whose smallest vertex is v: rows [first[v], first[v+1]) */
    mesher__wall   *facets, *rows;
    uint32_t *sides; /* 2*num_facets: cell behind and in front of the source triangle */
    int32_t *net;    /* num_facets: triangles oriented like the source minus those turned over */
    delaunay_handle *stack;       /* of the flood fill; then: piece -> cell */
    uint32_t        *parent;      /* union-find over the pieces of cells; piece 0: the outside */
    mesher__cell    *cells;
    uint32_t         num_cells;
    uint32_t        *number;      /* cell -> place in domain->regions + 1; 0: outside */
} mesher__coloring;

/* Sorts the facets into rows by their smallest vertex in the mesh, so that a sweep over the
 * tetrahedra finds them in the cache. */
static void mesher__index_facets(const mesher_domain *domain, mesher__coloring *work)
{
    const uint32_t *vertex_of = domain->mesh.vertex_of, *survivor = domain->survivor;
    uint32_t *first = work->first, v, f;
    long n = (long)domain->num_facets, i;
    int threads = delaunay_threads_for(&domain->options.host, domain->num_facets);
    (void)threads;
    MESHER__OMP(omp parallel for schedule(static) num_threads(threads))
    for (i = 0; i < n; i++) { /* each writes its own entry */
        const uint32_t *t = domain->surface.triangles + 3 * (size_t)domain->facet_source[i];
        mesher__wall *facet = work->facets + i;
        int j;
        for (j = 0; j < 3; j++) facet->v[j] = vertex_of[survivor[t[j]]];
        facet->facet = (uint32_t)i;
        facet->odd = (uint32_t)mesher__ascend(facet->v);
    }
    memset(first, 0, ((size_t)domain->mesh.num_vertices + 2) * sizeof *first);
    for (f = 0; f < domain->num_facets; f++) first[work->facets[f].v[0] + 2]++;
    for (v = 0; v < domain->mesh.num_vertices; v++) first[v + 2] += first[v + 1];
    for (f = 0; f < domain->num_facets; f++)
        work->rows[first[work->facets[f].v[0] + 1]++] = work->facets[f];
}

/* Index of the facet with these input vertices, given in ascending order, or NO_ID. A binary
 * search: the facets are sorted. */
static uint32_t mesher__facet_find(const mesher_domain *domain, const uint32_t *v)
{
    uint32_t lo = 0, hi = domain->num_facets, mid, j;
    while (lo < hi) {
        const uint32_t *m = domain->facets + 3 * (size_t)(mid = lo + (hi - lo) / 2);
        for (j = 0; j < 2 && m[j] == v[j]; j++) {}
        if (m[j] < v[j]) lo = mid + 1;
        else hi = mid;
    }
    return lo < domain->num_facets && memcmp(domain->facets + 3 * (size_t)lo, v, 3 * sizeof *v) == 0
               ? lo
               : DELAUNAY_NO_ID;
}

/* For each facet the sum over all triangles with its vertices: +1 for one that is oriented like the
 * source triangle, -1 for one that is turned over. */
static void mesher__net_orientation(const mesher_domain *domain, int32_t *net)
{
    size_t i, n = domain->surface.num_triangles;
    uint32_t v[3], w[3], f;
    for (f = 0; f < domain->num_facets; f++) net[f] = 1;
    if (domain->num_facets == n) return;
    memset(net, 0, domain->num_facets * sizeof *net);
    for (i = 0; i < n; i++) {
        int odd = mesher__sorted_triangle(domain, i, v);
        f = mesher__facet_find(domain, v);
        if (f == DELAUNAY_NO_ID) continue;
        net[f] += odd == mesher__sorted_triangle(domain, domain->facet_source[f], w) ? 1 : -1;
    }
}

/* The index of the input facet that is facet i of tetrahedron t, or NO_ID. *outward: whether the
 * normal of its source triangle points out of t. */
static uint32_t mesher__facet_of(const delaunay_mesh *mesh, const mesher__coloring *work,
                                 delaunay_handle t, int i, int *outward)
{
    const uint8_t *order = delaunay_facet_order(i);
    uint32_t v[3], r;
    int j, odd;
    for (j = 0; j < 3; j++) v[j] = mesh->tets[t].v[order[j]];
    odd = mesher__ascend(v);
    for (r = work->first[v[0]]; r < work->first[v[0] + 1]; r++) {
        const mesher__wall *row = work->rows + r;
        if (row->v[1] != v[1] || row->v[2] != v[2]) continue;
        *outward = odd == (int)row->odd;
        return row->facet;
    }
    return DELAUNAY_NO_ID;
}

static int mesher__is_corner(const mesher_domain *domain, uint32_t vertex)
{
    uint32_t id = domain->mesh.vertex_id[vertex];
    return vertex == DELAUNAY_GHOST ||
           (id >= domain->first_corner && id < domain->first_corner + 8);
}

static int mesher__touches_box(const mesher_domain *domain, delaunay_handle t)
{
    const uint32_t *v = domain->mesh.tets[t].v;
    return mesher__is_corner(domain, v[0]) || mesher__is_corner(domain, v[1]) ||
           mesher__is_corner(domain, v[2]) || mesher__is_corner(domain, v[3]);
}

/* Sets color[] = c for all slots in [lo, hi) that can be reached from t without crossing a
 * constrained facet or leaving the interval. Returns 1 if one of them touches the box. */
static int mesher__flood(const mesher_domain *domain, delaunay_handle *stack, delaunay_handle lo,
                         delaunay_handle hi, delaunay_handle t, uint32_t c)
{
    const delaunay_mesh *mesh = &domain->mesh;
    size_t top = 0;
    int i, outside = 0;
    mesh->color[t] = c;
    stack[top++] = t;
    while (top) {
        t = stack[--top];
        if (!outside) outside = mesher__touches_box(domain, t);
        for (i = 0; i < 4; i++) {
            delaunay_handle n = mesh->tets[t].n[i] / 4;
            if (n < lo || n >= hi || n == DELAUNAY_NONE || mesh->color[n] != DELAUNAY_NO_ID ||
                mesh->flags[t] & DELAUNAY_FACET_BIT(i))
                continue;
            mesh->color[n] = c;
            stack[top++] = n;
        }
    }
    return outside;
}

/* The slots are cut into intervals, whose number depends on the number of slots alone. */
#ifndef MESHER__INTERVAL /* tests make it small */
#  define MESHER__INTERVAL 65536
#endif
enum { MESHER__MOST_INTERVALS = 256 };

static size_t mesher__num_intervals(const delaunay_mesh *mesh)
{
    size_t n = (size_t)mesh->num_tets / MESHER__INTERVAL + 1;
    return n < (size_t)MESHER__MOST_INTERVALS ? n : (size_t)MESHER__MOST_INTERVALS;
}

static delaunay_handle mesher__interval(const delaunay_mesh *mesh, size_t k)
{
    return (delaunay_handle)((uint64_t)mesh->num_tets * k / mesher__num_intervals(mesh));
}

/* Colours the pieces of cells within one interval 0, 1, ..; returns their number. Sets
 * mark[lo + piece] for those that touch the box. Writes only the colours, marks and stack entries
 * of this interval, and reads no colours but its own. */
static uint32_t mesher__flood_interval(const mesher_domain *domain, delaunay_handle *stack,
                                       size_t k)
{
    const delaunay_mesh *mesh = &domain->mesh;
    delaunay_handle lo = mesher__interval(mesh, k), hi = mesher__interval(mesh, k + 1), t;
    uint32_t pieces = 0;
    for (t = lo; t < hi; t++) mesh->color[t] = DELAUNAY_NO_ID;
    for (t = lo ? lo : 1; t < hi; t++) {
        if (delaunay_is_deleted(mesh, t) || mesh->color[t] != DELAUNAY_NO_ID) continue;
        mesh->mark[lo + pieces] = (uint8_t)mesher__flood(domain, stack + lo, lo, hi, t, pieces);
        pieces++;
    }
    return pieces;
}

/* Joins the pieces of interval k to those of later intervals that they touch and, where they touch
 * the box, to the outside. start: number of the first piece of each interval. */
static void mesher__join_interval(const mesher_domain *domain, uint32_t *parent,
                                  const uint32_t *start, size_t k)
{
    const delaunay_mesh *mesh = &domain->mesh;
    delaunay_handle lo = mesher__interval(mesh, k), hi = mesher__interval(mesh, k + 1), t;
    uint32_t piece;
    int i;
    for (piece = 0; piece < start[k + 1] - start[k]; piece++) {
        if (mesh->mark[lo + piece]) mesher__join(parent, 0, start[k] + piece);
        mesh->mark[lo + piece] = 0;
    }
    for (t = lo ? lo : 1; t < hi; t++) {
        if (delaunay_is_deleted(mesh, t)) continue;
        for (i = 0; i < 4; i++) {
            delaunay_handle n = mesh->tets[t].n[i] / 4;
            size_t l = k + 1;
            if (n < hi || mesh->flags[t] & DELAUNAY_FACET_BIT(i)) continue;
            while (n >= mesher__interval(mesh, l + 1)) l++;
            mesher__join(parent, start[k] + mesh->color[t], start[l] + mesh->color[n]);
        }
    }
}

static double mesher__tet_volume(const delaunay_mesh *mesh, delaunay_handle t)
{
    const uint32_t *v = mesh->tets[t].v;
    const double *a = mesh->vertices[v[0]].x;
    double r[3][3];
    int i, j;
    for (i = 0; i < 3; i++)
        for (j = 0; j < 3; j++) r[i][j] = mesh->vertices[v[i + 1]].x[j] - a[j];
    return (r[0][0] * (r[1][1] * r[2][2] - r[1][2] * r[2][1]) +
            r[0][1] * (r[1][2] * r[2][0] - r[1][0] * r[2][2]) +
            r[0][2] * (r[1][0] * r[2][1] - r[1][1] * r[2][0])) /
           6;
}

/* Colours every tetrahedron with the number of its cell. Cells are numbered in the order of their
 * first slots; the outside is 0. Intervals of slots are flooded in parallel, each in its own
 * colours, then joined by one thread. */
static mesher_result mesher__find_cells(mesher_domain *domain, mesher__coloring *work)
{
    delaunay_mesh *mesh = &domain->mesh;
    uint32_t start[MESHER__MOST_INTERVALS + 1], p;
    long n = (long)mesher__num_intervals(mesh), k;
    int threads = delaunay_threads_for(&domain->options.host, mesh->num_tets);
    (void)threads;
    MESHER__OMP(omp parallel for schedule(dynamic, 1) num_threads(threads))
    for (k = 0; k < n; k++) start[k + 1] = mesher__flood_interval(domain, work->stack, (size_t)k);
    for (start[0] = 1, k = 0; k < n; k++) start[k + 1] += start[k]; /* piece 0 is the outside */
    work->parent = (uint32_t *)delaunay_alloc(&domain->memory, start[n], sizeof *work->parent);
    if (!work->parent) {
        memset(mesh->mark, 0, mesh->num_tets);
        return MESHER_ERROR_OUT_OF_MEMORY;
    }
    for (p = 0; p < start[n]; p++) work->parent[p] = p;
    for (k = 0; k < n; k++) mesher__join_interval(domain, work->parent, start, (size_t)k);
    for (p = work->num_cells = 0; p < start[n];
         p++) { /* a root is the first piece of its cell, so it gets the number */
        uint32_t root = work->parent[p] == p ? p : mesher__root(work->parent, p);
        work->stack[p] = root == p ? work->num_cells++ : work->stack[root];
    }
    /* Shared: the numbers of the cells, read only; colours are written by interval. */
    MESHER__OMP(omp parallel for schedule(dynamic, 1) num_threads(threads))
    for (k = 0; k < n; k++) {
        delaunay_handle t = mesher__interval(mesh, (size_t)k),
                        hi = mesher__interval(mesh, (size_t)k + 1);
        for (; t < hi; t++)
            mesh->color[t] = mesh->color[t] == DELAUNAY_NO_ID
                                 ? DELAUNAY_OUTSIDE
                                 : (uint32_t)work->stack[start[k] + mesh->color[t]];
    }
    work->cells =
        (mesher__cell *)delaunay_alloc(&domain->memory, work->num_cells, sizeof *work->cells);
    if (!work->cells) return MESHER_ERROR_OUT_OF_MEMORY;
    memset(work->cells, 0, work->num_cells * sizeof *work->cells);
    return MESHER_OK;
}

/* Fills in the cells on both sides of the facets of one interval's tetrahedra. Of the two
 * tetrahedra at a facet, only one writes. */
static void mesher__find_sides(const mesher_domain *domain, mesher__coloring *work, size_t k)
{
    const delaunay_mesh *mesh = &domain->mesh;
    delaunay_handle t = mesher__interval(mesh, k), hi = mesher__interval(mesh, k + 1);
    int i, outward = 0;
    for (t = t ? t : 1; t < hi; t++) {
        if (delaunay_is_deleted(mesh, t) || !(mesh->flags[t] & DELAUNAY_FACET_BITS)) continue;
        for (i = 0; i < 4; i++) {
            delaunay_handle n = mesh->tets[t].n[i] / 4;
            uint32_t f;
            if (!(mesh->flags[t] & DELAUNAY_FACET_BIT(i)) || (n && n < t)) continue;
            f = mesher__facet_of(mesh, work, t, i, &outward);
            if (f == DELAUNAY_NO_ID) continue;
            work->sides[2 * (size_t)f + (outward ? 0 : 1)] = mesh->color[t];
            work->sides[2 * (size_t)f + (outward ? 1 : 0)] = n ? mesh->color[n] : DELAUNAY_NO_ID;
        }
    }
}

/* Finds the first facet of each cell, in the order of the source triangles, and sums up volumes and
 * numbers of tetrahedra, in the order of the slots. */
static void mesher__measure_cells(mesher_domain *domain, mesher__coloring *work)
{
    const delaunay_mesh *mesh = &domain->mesh;
    delaunay_handle t;
    uint32_t c, f;
    long n = (long)mesher__num_intervals(mesh), k;
    int threads = delaunay_threads_for(&domain->options.host, mesh->num_tets), s;
    (void)threads;
    for (c = 0; c < work->num_cells; c++) {
        work->cells[c].key = UINT64_MAX;
        work->cells[c].facet = DELAUNAY_NO_ID;
    }
    memset(work->sides, 0xff, 2 * sizeof *work->sides * domain->num_facets); /* NO_ID */
    /* Shared: the mesh, read only; the sides of a facet are written by one of its tetrahedra. */
    MESHER__OMP(omp parallel for schedule(dynamic, 1) num_threads(threads))
    for (k = 0; k < n; k++) mesher__find_sides(domain, work, (size_t)k);
    for (f = 0; f < domain->num_facets; f++)
        for (s = 0; s < 2; s++) {
            uint64_t key = 2 * (uint64_t)domain->facet_source[f] + (uint64_t)s;
            c = work->sides[2 * (size_t)f + (size_t)s];
            if (c == DELAUNAY_NO_ID || key >= work->cells[c].key) continue;
            work->cells[c].key = key;
            work->cells[c].facet = f;
        }
    for (t = 1; t < mesh->num_tets; t++) {
        mesher__cell *cell = work->cells + mesh->color[t];
        if (mesh->color[t] == 0) continue;
        cell->num_tets++;
        cell->volume += mesher__tet_volume(mesh, t);
    }
}

/* Makes each bounded cell a region, in the order of their first facets. */
static mesher_result mesher__sort_cells(mesher_domain *domain, mesher__coloring *work)
{
    delaunay_memory *memory = &domain->memory;
    uint32_t n = work->num_cells - 1, i;
    mesher_result result;
    hxtsort_pair *pairs = (hxtsort_pair *)delaunay_alloc(memory, n, sizeof *pairs);
    if (!pairs) return MESHER_ERROR_OUT_OF_MEMORY;
    for (i = 0; i < n; i++) {
        pairs[i].key = work->cells[i + 1].key;
        pairs[i].value = i + 1;
    }
    result = mesher__sort(domain, pairs, n);
    if (result != MESHER_OK) goto done;
    result = MESHER_ERROR_OUT_OF_MEMORY;
    work->number = (uint32_t *)delaunay_alloc(memory, work->num_cells, sizeof *work->number);
    if (!work->number) goto done;
    delaunay_release(memory, domain->regions);
    domain->num_regions = 0;
    domain->regions = (mesher_region *)delaunay_alloc_zeroed(memory, n, sizeof *domain->regions);
    if (!domain->regions) goto done;
    work->number[0] = 0;
    for (i = 0; i < n; i++) {
        const mesher__cell *cell = work->cells + pairs[i].value;
        mesher_region *region = domain->regions + i;
        work->number[pairs[i].value] = i + 1;
        region->first_facet =
            cell->facet == DELAUNAY_NO_ID ? cell->facet : domain->facet_source[cell->facet];
        region->num_tets = cell->num_tets;
        region->volume = cell->volume;
        region->depth = UINT32_MAX;
    }
    domain->num_regions = n;
    result = MESHER_OK;
done:
    delaunay_release(memory, pairs);
    return result;
}

/* Depth and winding number of every region, by a breadth-first search through the facets from the
 * outside. */
static mesher_result mesher__nest_cells(mesher_domain *domain, mesher__coloring *work)
{
    delaunay_memory *memory = &domain->memory;
    uint32_t n = work->num_cells, f, i, head = 0, tail = 0, a, b;
    uint32_t *start = NULL, *links = NULL, *queue = NULL;
    mesher_result result = MESHER_ERROR_OUT_OF_MEMORY;
    int s;
    start = (uint32_t *)delaunay_alloc(memory, (size_t)n + 2, sizeof *start);
    links = (uint32_t *)delaunay_alloc(memory, domain->num_facets, 2 * sizeof *links);
    queue = (uint32_t *)delaunay_alloc(memory, n, sizeof *queue);
    if (!start || !links || !queue) goto done;
    memset(start, 0, ((size_t)n + 2) * sizeof *start);
    for (f = 0; f < 2 * domain->num_facets; f++) /* counting sort of the sides by region */
        if (work->sides[f] != DELAUNAY_NO_ID) start[work->number[work->sides[f]] + 2]++;
    for (i = 0; i < n; i++) start[i + 2] += start[i + 1];
    for (f = 0; f < 2 * domain->num_facets; f++)
        if (work->sides[f] != DELAUNAY_NO_ID) links[start[work->number[work->sides[f]] + 1]++] = f;
    queue[tail++] = 0;
    while (head < tail) {
        a = queue[head++];
        for (i = start[a]; i < start[a + 1]; i++) {
            f = links[i] / 2;
            s = (int)(links[i] & 1);
            if (work->sides[links[i] ^ 1] == DELAUNAY_NO_ID) continue;
            b = work->number[work->sides[links[i] ^ 1]];
            if (b == 0 || domain->regions[b - 1].depth != UINT32_MAX) continue;
            domain->regions[b - 1].depth = a ? domain->regions[a - 1].depth + 1 : 1;
            domain->regions[b - 1].winding =
                (a ? domain->regions[a - 1].winding : 0) +
                (s == 1 ? work->net[f] : -work->net[f]); /* 1: from in front of f to its inside */
            queue[tail++] = b;
        }
    }
    result = MESHER_OK;
done:
    delaunay_release(memory, queue);
    delaunay_release(memory, links);
    delaunay_release(memory, start);
    return result;
}

/* Enters the first seed of each region, plus 1, into seed_of, and gives the region that seed's tag
 * as number, 0 for a hole. *any: some seed has a tag > 0. */
static void mesher__apply_seeds(mesher_domain *domain, const mesher__coloring *work,
                                size_t *seed_of, int *any, mesher_report *report)
{
    const mesher_surface *surface = &domain->surface;
    const delaunay_mesh *mesh = &domain->mesh;
    size_t i;
    *any = 0;
    for (i = 0; i < surface->num_seeds; i++) {
        const double *x = surface->seeds + 3 * i;
        const int32_t tag = surface->seed_tags ? surface->seed_tags[i] : (int32_t)(i + 1);
        const uint32_t number = tag > 0 ? (uint32_t)tag : 0;
        const delaunay_handle t = delaunay_locate(mesh, x, 0);
        const uint32_t r = t ? work->number[mesh->color[t]] : 0;
        if (tag > 0) *any = 1;
        if (r == 0) {
            mesher_report_add(report, MESHER_NOTE_OUTSIDE_SEED, DELAUNAY_NO_ID, DELAUNAY_NO_ID,
                              (uint32_t)i, DELAUNAY_NO_ID, DELAUNAY_NO_ID, x);
        } else if (seed_of[r - 1] == 0) {
            seed_of[r - 1] = i + 1;
            domain->regions[r - 1].number = number;
        } else if (domain->regions[r - 1].number != number) {
            mesher_report_add(report, MESHER_NOTE_SHARED_CELL, DELAUNAY_NO_ID, DELAUNAY_NO_ID,
                              (uint32_t)i, (uint32_t)(seed_of[r - 1] - 1), DELAUNAY_NO_ID, x);
        }
    }
}

/* Adds a note for each region without a seed, if others are kept. */
static void mesher__note_unseeded(const mesher_domain *domain, const size_t *seed_of,
                                  mesher_report *report)
{
    const mesher_surface *surface = &domain->surface;
    uint32_t i;
    for (i = 0; i < domain->num_regions && domain->regions[i].number == 0; i++) {}
    if (i == domain->num_regions) return;
    for (i = 0; i < domain->num_regions; i++) {
        const uint32_t f = domain->regions[i].first_facet;
        if (seed_of[i] == 0 && f != DELAUNAY_NO_ID)
            mesher__add_triangle_finding(report, MESHER_NOTE_UNSEEDED_CELL, surface, f,
                                         DELAUNAY_NO_ID, surface->triangles + 3 * (size_t)f);
    }
}

/* Which regions the policy keeps, and their numbers. */
static mesher_result mesher__keep_cells(mesher_domain *domain, const mesher__coloring *work,
                                        mesher_report *report)
{
    mesher_regions policy = domain->options.regions;
    uint32_t i, next = 0;
    size_t *seed_of = (size_t *)delaunay_alloc_zeroed(&domain->memory, domain->num_regions,
                                                      sizeof *seed_of);
    int any = 0;
    if (!seed_of) return MESHER_ERROR_OUT_OF_MEMORY;
    if (policy == MESHER_REGIONS_SEEDS)
        mesher__apply_seeds(domain, work, seed_of, &any, report);
    if (policy == MESHER_REGIONS_SEEDS) mesher__note_unseeded(domain, seed_of, report);
    for (i = 0; i < domain->num_regions; i++) {
        mesher_region *region = domain->regions + i;
        switch (policy) {
        case MESHER_REGIONS_ALL: region->kept = 1; break;
        case MESHER_REGIONS_PARITY: region->kept = (int)(region->depth & 1); break;
        case MESHER_REGIONS_WINDING: region->kept = region->winding != 0; break;
        case MESHER_REGIONS_SEEDS: region->kept = any ? region->number > 0 : !seed_of[i]; break;
        }
        if (!region->kept) region->number = 0;
        else if (!any) region->number = ++next;
    }
    delaunay_release(&domain->memory, seed_of);
    return MESHER_OK;
}

/* Adds a note for each kept region at an even depth, if the connected part of the surface that its
 * first facet belongs to does not touch the outside: another program may take it for a void. */
static mesher_result mesher__note_filled(mesher_domain *domain, const mesher__coloring *work,
                                         mesher_report *report)
{
    const mesher_surface *surface = &domain->surface;
    delaunay_memory *memory = &domain->memory;
    uint32_t n = domain->first_corner, v, f, i;
    uint32_t *parent = (uint32_t *)delaunay_alloc(memory, n, sizeof *parent);
    uint8_t *outer = (uint8_t *)delaunay_alloc(memory, n, 1);
    if (parent && outer) {
        memset(outer, 0, n);
        for (v = 0; v < n; v++) parent[v] = v;
        for (f = 0; f < domain->num_facets; f++) {
            const uint32_t *p = domain->facets + 3 * (size_t)f;
            for (i = 1; i < 3; i++) mesher__join(parent, p[0], p[i]);
        }
        for (f = 0; f < domain->num_facets; f++)
            if (work->sides[2 * (size_t)f] == 0 || work->sides[2 * (size_t)f + 1] == 0)
                outer[mesher__root(parent, domain->facets[3 * (size_t)f])] = 1;
        for (i = 0; i < domain->num_regions; i++) {
            const mesher_region *region = domain->regions + i;
            const uint32_t *t;
            if (!region->kept || region->depth & 1 || region->first_facet == DELAUNAY_NO_ID)
                continue;
            t = surface->triangles + 3 * (size_t)region->first_facet;
            if (outer[mesher__root(parent, domain->survivor[t[0]])]) continue;
            mesher__add_triangle_finding(report, MESHER_NOTE_SHELL_FILLED, surface,
                                         region->first_facet, DELAUNAY_NO_ID, t);
        }
    }
    delaunay_release(memory, outer);
    delaunay_release(memory, parent);
    return parent && outer ? MESHER_OK : MESHER_ERROR_OUT_OF_MEMORY;
}

/* Reports facets with the same cell on both sides: within a bounded cell as a note (a sheet),
 * outside every cell as a defect, or a note if these are dropped. */
static void mesher__note_sheets(const mesher_domain *domain, const mesher__coloring *work,
                                mesher_report *report)
{
    const mesher_kind outside = domain->options.drop_outside ? MESHER_NOTE_OUTSIDE_FACET
                                                             : MESHER_DEFECT_OUTSIDE_FACET;
    uint32_t f;
    for (f = 0; f < domain->num_facets; f++) {
        uint32_t a = work->sides[2 * (size_t)f], b = work->sides[2 * (size_t)f + 1];
        if (a != b || a == DELAUNAY_NO_ID) continue;
        mesher__add_triangle_finding(report, a ? MESHER_NOTE_SHEET : outside, &domain->surface,
                                     domain->facet_source[f], DELAUNAY_NO_ID,
                                     domain->facets + 3 * (size_t)f);
    }
}

/* Adds a note for each line that lies outside the kept cells. A line that is an edge of no facet
 * lies in one cell, as do all tetrahedra around it. Needs vertex_tet. */
static mesher_result mesher__note_lines(mesher_domain *domain, mesher_report *report)
{
    delaunay_mesh *mesh = &domain->mesh;
    delaunay_worker *worker = NULL;
    uint32_t e;
    for (e = 0; e < domain->num_edges && mesh->vertex_tet; e++) {
        const uint32_t *edge = domain->edges + 2 * (size_t)e;
        delaunay_handle t;
        if (domain->edge_source[e] < domain->surface.num_triangles) continue;
        if (!worker) worker = delaunay_worker_new(&mesh->memory);
        if (!worker) return MESHER_ERROR_OUT_OF_MEMORY;
        t = delaunay_find_edge(mesh, worker, mesh->vertex_of[edge[0]], mesh->vertex_of[edge[1]]);
        if (t && mesh->color[t] == DELAUNAY_OUTSIDE)
            mesher__add_edge_finding(report, MESHER_NOTE_OUTSIDE_LINE, &domain->surface,
                                     domain->edge_source[e], DELAUNAY_NO_ID, edge);
    }
    delaunay_worker_free(worker);
    return MESHER_OK;
}

/* Hands the sides of the facets to the domain, as places of regions plus 1. */
static void mesher__keep_sides(mesher_domain *domain, mesher__coloring *work)
{
    size_t i;
    for (i = 0; i < 2 * (size_t)domain->num_facets; i++)
        if (work->sides[i] != DELAUNAY_NO_ID) work->sides[i] = work->number[work->sides[i]];
    delaunay_release(&domain->memory, domain->facet_sides);
    domain->facet_sides = work->sides;
    work->sides = NULL;
}

static void mesher__paint(mesher_domain *domain, const mesher__coloring *work)
{
    delaunay_mesh *mesh = &domain->mesh;
    delaunay_handle t;
    for (t = 1; t < mesh->num_tets; t++) {
        uint32_t r = work->number[mesh->color[t]];
        mesh->color[t] = r ? domain->regions[r - 1].number : DELAUNAY_OUTSIDE;
    }
}

static mesher_result mesher__color_alloc(mesher_domain *domain, mesher__coloring *work)
{
    delaunay_memory *memory = &domain->memory;
    const delaunay_mesh *mesh = &domain->mesh;
    work->first =
        (uint32_t *)delaunay_alloc(memory, (size_t)mesh->num_vertices + 2, sizeof *work->first);
    work->facets = (mesher__wall *)delaunay_alloc(memory, domain->num_facets, sizeof *work->facets);
    work->rows = (mesher__wall *)delaunay_alloc(memory, domain->num_facets, sizeof *work->rows);
    work->sides = (uint32_t *)delaunay_alloc(memory, domain->num_facets, 2 * sizeof *work->sides);
    work->net = (int32_t *)delaunay_alloc(memory, domain->num_facets, sizeof *work->net);
    work->stack =
        (delaunay_handle *)delaunay_alloc(memory, (size_t)mesh->num_tets + 1, sizeof *work->stack);
    return work->first && work->facets && work->rows && work->sides && work->net && work->stack
               ? MESHER_OK
               : MESHER_ERROR_OUT_OF_MEMORY;
}

static int mesher__is_inside(const delaunay_mesh *mesh, delaunay_handle t)
{
    return !delaunay_is_deleted(mesh, t) && !delaunay_is_ghost(mesh, t) &&
           mesh->color[t] != DELAUNAY_OUTSIDE;
}

/* Counts the Steiner points that stay: not those that are in no kept cell. */
static mesher_result mesher__count_points(mesher_domain *domain, mesher_report *report)
{
    const delaunay_mesh *mesh = &domain->mesh;
    uint8_t *stays;
    delaunay_handle t;
    uint32_t v;
    int k;
    if (report->interior_steiner == 0) return MESHER_OK; /* or the report is another one */
    stays = (uint8_t *)delaunay_alloc_zeroed(&domain->memory, mesh->num_vertices, 1);
    if (!stays) return MESHER_ERROR_OUT_OF_MEMORY;
    for (t = 1; t < mesh->num_tets; t++)
        for (k = 0; k < 4 && mesher__is_inside(mesh, t); k++) stays[mesh->tets[t].v[k]] = 1;
    for (v = 1; v < mesh->num_vertices; v++)
        if (mesh->vertex_id[v] == DELAUNAY_NO_ID && !stays[v] && report->interior_steiner)
            report->interior_steiner--;
    delaunay_release(&domain->memory, stays);
    return MESHER_OK;
}

static mesher_result mesher__color_with(mesher_domain *domain, mesher__coloring *work,
                                        mesher_report *report)
{
    uint32_t i;
    uint64_t defects = mesher__count_defects(report);
    mesher_result result = mesher__color_alloc(domain, work);
    if (result != MESHER_OK) return result;
    mesher__index_facets(domain, work);
    mesher__net_orientation(domain, work->net);
    result = mesher__find_cells(domain, work);
    if (result != MESHER_OK) return result;
    mesher__measure_cells(domain, work);
    result = mesher__sort_cells(domain, work);
    if (result != MESHER_OK) return result;
    result = mesher__nest_cells(domain, work);
    if (result != MESHER_OK) return result;
    result = mesher__keep_cells(domain, work, report);
    if (result != MESHER_OK) return result;
    mesher__note_sheets(domain, work, report);
    result = mesher__note_filled(domain, work, report);
    if (result != MESHER_OK) return result;
    mesher__paint(domain, work);
    result = mesher__note_lines(domain, report);
    if (result != MESHER_OK) return result;
    if (domain->stage == MESHER__STAGE_RECOVERED) result = mesher__count_points(domain, report);
    if (result != MESHER_OK) return result;
    mesher__keep_sides(domain, work);
    for (i = 0, report->num_regions = 0; i < domain->num_regions; i++)
        report->num_regions += domain->regions[i].kept != 0;
    if (report->num_regions == 0)
        mesher_report_add(report,
                          domain->num_regions ? MESHER_DEFECT_NONE_KEPT : MESHER_DEFECT_NO_CELL,
                          DELAUNAY_NO_ID, DELAUNAY_NO_ID, DELAUNAY_NO_ID, DELAUNAY_NO_ID,
                          DELAUNAY_NO_ID, NULL);
    return mesher__count_defects(report) > defects ? MESHER_ERROR_SURFACE : MESHER_OK;
}

MESHER_API mesher_result mesher_color(mesher_domain *domain, mesher_report *report)
{
    delaunay_memory *memory;
    mesher__coloring work;
    mesher_report local;
    mesher_result result;
    double start;
    if (!mesher__enter(report, domain && domain->stage >= MESHER__STAGE_INIT &&
                                   domain->stage != MESHER__STAGE_EMPTY && domain->mesh.tets &&
                                   domain->mesh.vertex_of && !domain->keeps_mesh))
        return MESHER_ERROR_INVALID_ARGUMENT;
    start = delaunay_seconds(&domain->options.host);
    memset(&work, 0, sizeof work);
    memset(&local, 0, sizeof local);
    memory = &domain->memory;
    result = (mesher_result)delaunay_enable_marks(&domain->mesh);
    if (result == MESHER_OK) result = mesher__color_with(domain, &work, report ? report : &local);
    if (result == MESHER_OK) domain->stage = MESHER__STAGE_COLORED;
    if (report) report->seconds_regions = delaunay_seconds(&domain->options.host) - start;
    delaunay_release(memory, work.number);
    delaunay_release(memory, work.cells);
    delaunay_release(memory, work.stack);
    delaunay_release(memory, work.net);
    delaunay_release(memory, work.sides);
    delaunay_release(memory, work.rows);
    delaunay_release(memory, work.facets);
    delaunay_release(memory, work.first);
    delaunay_release(memory, work.parent);
    return result;
}

MESHER_API mesher_result mesher_region_tags(mesher_domain *domain, uint32_t i, int32_t *tags,
                                            size_t cap, size_t *count)
{
    const mesher_surface *surface;
    hxtsort_pair *pairs;
    mesher_result result;
    size_t n = 0, t, num = 0;
    if (!domain || !count || !domain->facet_sides || i >= domain->num_regions)
        return MESHER_ERROR_INVALID_ARGUMENT;
    surface = &domain->surface;
    pairs = (hxtsort_pair *)delaunay_alloc(&domain->memory, surface->num_triangles, sizeof *pairs);
    if (!pairs) return MESHER_ERROR_OUT_OF_MEMORY;
    for (t = 0; t < surface->num_triangles;
         t++) { /* all triangles: a duplicate may have a tag of its own */
        uint32_t v[3], f;
        mesher__sorted_triangle(domain, t, v);
        f = mesher__facet_find(domain, v);
        if (f == DELAUNAY_NO_ID) continue;
        if (domain->facet_sides[2 * (size_t)f] != i + 1 &&
            domain->facet_sides[2 * (size_t)f + 1] != i + 1)
            continue;
        pairs[n++].key =
            (uint64_t)((int64_t)(surface->triangle_tags ? surface->triangle_tags[t] : 1) -
                       INT32_MIN);
    }
    for (t = 0; t < n; t++) pairs[t].value = t;
    result = mesher__sort(domain, pairs, n);
    for (t = 0; t < n && result == MESHER_OK; t++) {
        if (t && pairs[t].key == pairs[t - 1].key) continue;
        if (tags && num < cap) tags[num] = (int32_t)((int64_t)pairs[t].key + INT32_MIN);
        num++;
    }
    *count = num;
    delaunay_release(&domain->memory, pairs);
    return result;
}

/* ---- >>size ------------------------------------------------------------------------------- */
/* The wanted edge length h. On the surface it is the mean length of the constrained edges at a
 * vertex [Marot 2020, 7]. Inside it is interpolated in the background: a copy of the mesh as it was
 * before refinement, so h(x) does not depend on the order in which points are inserted. The
 * gradation bounds h from vertex to vertex. It also bounds h at x, by h(v) + slope*|x - v| for
 * those vertices v whose sizes bound the corners of the background's tetrahedron around x. The
 * values interpolated are the sizes before the gradation bounded them, so a plate with a small
 * fillet at each of its corners is not filled with the fillets' sizes; and before options.size and
 * max_size did: these bound what is interpolated. (If they bounded the sizes at the vertices, those
 * around a small ball in a large box would grow more slowly, up to the same bound: with one of a
 * twentieth of the box's size there would be five times as many tetrahedra.) */

static double mesher__distance(const double *a, const double *b)
{
    double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
    return sqrt(x * x + y * y + z * z);
}

/* The smallest size that coordinates of the mesh's magnitude can resolve: 45 to 90 units in the
 * last place of the largest ones. */
static double mesher__size_floor(const delaunay_mesh *mesh)
{
    double most = 0;
    uint32_t v;
    int i;
    for (v = 1; v < mesh->num_vertices; v++)
        for (i = 0; i < 3; i++)
            if (fabs(mesh->vertices[v].x[i]) > most) most = fabs(mesh->vertices[v].x[i]);
    return most * 1e-14;
}

/* A size that the caller asks for (0 or less, or NaN: none), times options.size_factor. A product
 * that is too small for a double is not the same as none. */
static double mesher__scaled(const mesher_options *o, double wish)
{
    double scaled = o->size_factor > 0 ? o->size_factor * wish : wish;
    return wish > 0 && !(scaled > 0) ? DBL_MIN : scaled;
}

/* The size that no other exceeds, by size and max_size. */
static double mesher__size_cap(const mesher_options *o)
{
    double cap = o->max_size > 0 ? o->max_size : HUGE_VAL, wish = mesher__scaled(o, o->size);
    if (wish > 0 && cap > wish) cap = wish;
    return o->min_size > cap ? o->min_size : cap;
}

static double mesher__clamp_size(const mesher_options *o, double h)
{
    const double cap = mesher__size_cap(o);
    if (h > cap) h = cap;
    return o->min_size > h ? o->min_size : h;
}

/* Where the caller asks for no sizes, edges inside are wanted this much longer than those of the
 * surface around them. With 1, scans get 1.6 to 2.2 times as many tetrahedra as HXT makes of them
 * (its edges come out longer than its sizes); with 1.3, about as many, and their mean gamma is
 * still the better one. */
#define MESHER__INWARDS 1.3
/* No size at a vertex of a surface is larger than so many times the mean length of its edges, and
 * sizes grow by no more than this inwards. Larger ones save hardly a tetrahedron, as there is one
 * for each triangle, but they are flat or long: twice the default's size leaves none of gamma below
 * 0.35 on a sphere of 5 120 triangles, and five times all of them. */
#define MESHER__LOOSEST     2.6
#define MESHER__MOST_GROWTH 1.7

/* The largest ratio of sizes one edge apart, if the caller gives none. With 1.4, surfaces whose
 * edges have very different lengths get 1.4 to 3.5 times as many tetrahedra as with 2; the
 * interpolation of [Marot 2020, 7] comes to about 2. Around sources, whose places the caller has
 * chosen, 1.4 gives the better mesh. */
#  define MESHER__GRADATION            2.0
#  define MESHER__GRADATION_OF_SOURCES 1.4

/* A speck is a cluster of tiny triangles, such as an isosurface has where it passes a node of its
 * grid at 1e-9 of the spacing; the triangles beside it are needles. Grading the sizes from each
 * speck to its surroundings would take hundreds of points and leave the needles as bad as before.
 * So the sizes at the two ends of a surface edge are made to differ by no more than this ratio.
 * With 16, needles of ordinary parts are affected, and their mean gamma falls. */
#  define MESHER__SPECK 64

/* Raises the size of each vertex of the surface until it is no less than that of any vertex it
 * shares an edge of the surface with, divided by MESHER__SPECK. */
static void mesher__level_specks(mesher_domain *domain)
{
    const uint32_t *vertex_of = domain->mesh.vertex_of;
    double *size = domain->size;
    int changed = 1;
    size_t e, k;
    while (changed)
        for (changed = 0, e = 0; e < domain->num_edges; e++)
            for (k = 0; k < 2; k++) {
                uint32_t a = vertex_of[domain->edges[2 * e + k]],
                         b = vertex_of[domain->edges[2 * e + 1 - k]];
                double least = size[b] / MESHER__SPECK;
                if (a == 0 || b == 0 || !(size[a] < least)) continue;
                size[a] = least * (1 + 1e-9);
                changed = 1;
            }
}

/* The size of each vertex, from the mean length of the surface's edges at it (of all its edges if
 * the caller's mesh is kept) or from the caller's vertex_sizes; 0 where there is neither. */
static mesher_result mesher__edge_sizes(mesher_domain *domain)
{
    delaunay_mesh *mesh = &domain->mesh;
    const double loosest = domain->keeps_mesh ? 2 : MESHER__LOOSEST,
                 ratio = mesher__scaled(&domain->options, domain->keeps_mesh ? 1 : MESHER__INWARDS),
                 usual = ratio < loosest ? ratio : loosest;
    double *size = domain->size;
    uint32_t e, v,
        *count = (uint32_t *)delaunay_alloc(&mesh->memory, mesh->num_vertices, sizeof *count);
    delaunay_handle t;
    int i;
    if (!count) return MESHER_ERROR_OUT_OF_MEMORY;
    memset(count, 0, mesh->num_vertices * sizeof *count);
    memset(size, 0, mesh->num_vertices * sizeof *size);
    for (e = 0; e < domain->num_edges && !domain->keeps_mesh; e++) {
        uint32_t a = mesh->vertex_of[domain->edges[2 * (size_t)e]],
                 b = mesh->vertex_of[domain->edges[2 * (size_t)e + 1]];
        double l = mesher__distance(mesh->vertices[a].x, mesh->vertices[b].x);
        if (a == 0 || b == 0) continue;
        size[a] += l;
        size[b] += l;
        count[a]++;
        count[b]++;
    }
    for (t = 1; domain->keeps_mesh && t < mesh->num_tets; t++) /* edges count once a tetrahedron */
        for (i = 0; i < 6; i++) {
            uint32_t a = mesh->tets[t].v[delaunay_edge_order(i)[0]],
                     b = mesh->tets[t].v[delaunay_edge_order(i)[1]];
            double l = mesher__distance(mesh->vertices[a].x, mesh->vertices[b].x);
            size[a] += l;
            size[b] += l;
            count[a]++;
            count[b]++;
        }
    for (v = 1; v < mesh->num_vertices; v++)
        if (count[v]) size[v] *= usual / count[v];
    if (!domain->keeps_mesh) mesher__level_specks(domain);
    for (v = 1; v < mesh->num_vertices; v++) {
        uint32_t id = mesh->vertex_id[v];
        double own = domain->options.vertex_sizes && id < domain->surface.num_vertices
                         ? domain->options.vertex_sizes[id]
                         : 0;
        double most = count[v] ? loosest / usual * size[v] : DBL_MAX;
        if (!(own > 0 && own <= DBL_MAX)) continue;
        own = mesher__scaled(&domain->options, own);
        size[v] = own < most ? own : most;
    }
    delaunay_release(&mesh->memory, count);
    return MESHER_OK;
}

/* Vertices without an edge of the surface (Steiner points of recovery, embedded points) get the
 * mean of their neighbours' sizes, weighted by the reciprocal of the distance. This takes several
 * passes; each reads only sizes that were there before it. */
static mesher_result mesher__spread_sizes(mesher_domain *domain)
{
    delaunay_mesh *mesh = &domain->mesh;
    double *size = domain->size, *sum = NULL;
    delaunay_handle t;
    uint32_t v, found = 1;
    for (v = 1; v < mesh->num_vertices && size[v] > 0; v++) {}
    if (v == mesh->num_vertices) return MESHER_OK;
    sum = (double *)delaunay_alloc(&mesh->memory, mesh->num_vertices, 2 * sizeof *sum);
    if (!sum) return MESHER_ERROR_OUT_OF_MEMORY;
    while (found) {
        memset(sum, 0, 2 * sizeof *sum * mesh->num_vertices);
        for (t = 1; t < mesh->num_tets; t++) {
            int i, j;
            if (!mesher__is_inside(mesh, t)) continue;
            for (i = 0; i < 4; i++)
                for (j = 0; j < 4; j++) {
                    uint32_t a = mesh->tets[t].v[i], b = mesh->tets[t].v[j];
                    double d, w;
                    if (size[a] > 0 || !(size[b] > 0)) continue;
                    d = mesher__distance(mesh->vertices[a].x, mesh->vertices[b].x);
                    w = 1 / (d > 1e-150 ? d : 1e-150); /* squares of less underflow */
                    sum[2 * (size_t)a] += w * size[b];
                    sum[2 * (size_t)a + 1] += w;
                }
        }
        for (found = 0, v = 1; v < mesh->num_vertices; v++)
            if (!(size[v] > 0) && sum[2 * (size_t)v + 1] > 0) {
                size[v] = sum[2 * (size_t)v] / sum[2 * (size_t)v + 1];
                found += size[v] > 0;
            }
    }
    delaunay_release(&mesh->memory, sum);
    return MESHER_OK;
}

enum { MESHER__BATCH = 1024 };

static double mesher__slope(const mesher_options *o)
{
    return (o->gradation > 0 ? o->gradation : MESHER__GRADATION) - 1;
}

/* Do the options have sizes for any place: of a function, regions, sources, a grid or a mesh? */
static int mesher__has_wishes(const mesher_options *o)
{
    return o->size_function || o->num_region_sizes || o->num_sources || o->size_grid ||
           o->size_mesh;
}

/* The point of segment a-b that is nearest to x, as a parameter from 0 (a) to 1 (b). */
static double mesher__along(const double *a, const double *b, const double *x)
{
    double dot = 0, ll = 0;
    int i;
    for (i = 0; i < 3; i++) {
        dot += (b[i] - a[i]) * (x[i] - a[i]);
        ll += (b[i] - a[i]) * (b[i] - a[i]);
    }
    if (!(dot > 0)) return 0;
    return dot < ll ? dot / ll : 1;
}

static double mesher__segment_distance(const double *a, const double *b, const double *x)
{
    double t = mesher__along(a, b, x), c[3];
    int i;
    for (i = 0; i < 3; i++) c[i] = a[i] + t * (b[i] - a[i]);
    return mesher__distance(c, x);
}

/* The distance from x to a triangle: if x projects into its interior, the height above its plane,
 * else the distance to the nearest side. w: weights of the corners at the nearest place. */
static double mesher__triangle_distance(const double *a, const double *b, const double *c,
                                        const double *x, double *w)
{
    const double *p[4];
    double n[3], side[3], best = 0, height = 0, nn = 0;
    int i, k, inside = 1;
    p[0] = p[3] = a;
    p[1] = b;
    p[2] = c;
    mesher__normal(a, b, c, n);
    for (i = 0; i < 3; i++) {
        height += n[i] * (x[i] - a[i]);
        nn += n[i] * n[i];
    }
    for (k = 0; k < 3; k++) {
        side[k] = 0;
        for (i = 0; i < 3; i++) {
            int j = (i + 1) % 3, l = (i + 2) % 3;
            side[k] += n[i] * ((p[k + 1][j] - p[k][j]) * (x[l] - p[k][l]) -
                               (p[k + 1][l] - p[k][l]) * (x[j] - p[k][j]));
        }
        if (side[k] < 0) inside = 0;
    }
    if (inside && nn > 0) {
        for (k = 0; k < 3; k++) w[(k + 2) % 3] = side[k] / nn;
        return fabs(height) / sqrt(nn);
    }
    for (k = 0; k < 3; k++) {
        double d = mesher__segment_distance(p[k], p[k + 1], x);
        if (k > 0 && !(d < best)) continue;
        best = d;
        w[(k + 1) % 3] = mesher__along(p[k], p[k + 1], x);
        w[k] = 1 - w[(k + 1) % 3];
        w[(k + 2) % 3] = 0;
    }
    return best;
}

static double mesher__box_distance(const double *a, const double *b, const double *x)
{
    double sum = 0;
    int i;
    for (i = 0; i < 3; i++) {
        double lo = a[i] < b[i] ? a[i] : b[i], hi = a[i] < b[i] ? b[i] : a[i];
        double d = x[i] < lo ? lo - x[i] : x[i] > hi ? x[i] - hi : 0;
        sum += d * d;
    }
    return sqrt(sum);
}

MESHER_API double mesher_source_size(const mesher_source *s, double gradation, const double *x)
{
    double w[3], d = 0,
           slope = s->slope > 0
                       ? s->slope
                       : (gradation > 0 ? gradation : MESHER__GRADATION_OF_SOURCES) - 1;
    switch (s->shape) {
    case MESHER_SHAPE_BALL: d = mesher__distance(s->xyz, x); break;
    case MESHER_SHAPE_BOX: d = mesher__box_distance(s->xyz, s->xyz + 3, x); break;
    case MESHER_SHAPE_SEGMENT: d = mesher__segment_distance(s->xyz, s->xyz + 3, x); break;
    case MESHER_SHAPE_TRIANGLE:
        d = mesher__triangle_distance(s->xyz, s->xyz + 3, s->xyz + 6, x, w);
        break;
    }
    d -= s->radius;
    return d > 0 ? s->size + slope * d : s->size;
}

/* The mean of n sizes by shares that add up to 1, of those that ask for something; 0 if these have
 * no more than half of the shares. */
static double mesher__mean_size(const double *share, const double *size, int n)
{
    double sum = 0, weight = 0;
    int i;
    for (i = 0; i < n; i++) {
        if (!(size[i] > 0) || size[i] > DBL_MAX || !(share[i] > 0)) continue;
        sum += share[i] * size[i];
        weight += share[i];
    }
    return weight > 0.5 ? sum / weight : 0;
}

MESHER_API double mesher_size_grid_at(const mesher_size_grid *g, const double *x)
{
    double w[3], share[8], size[8];
    size_t cell[3], k;
    int i;
    for (i = 0; i < 3; i++) {
        double at = (x[i] - g->origin[i]) / g->spacing[i], last = g->count[i] - 1.0;
        at = at > 0 ? at < last ? at : last : 0;
        cell[i] = (size_t)at;
        if (cell[i] > g->count[i] - 2) cell[i] = g->count[i] - 2;
        w[i] = at - (double)cell[i];
    }
    for (k = 0; k < 8; k++) {
        share[k] =
            (k & 1 ? w[0] : 1 - w[0]) * (k & 2 ? w[1] : 1 - w[1]) * (k & 4 ? w[2] : 1 - w[2]);
        size[k] = g->size[cell[0] + (k & 1) +
                          g->count[0] * (cell[1] + (k >> 1 & 1) +
                                         (size_t)g->count[1] * (cell[2] + (k >> 2)))];
    }
    return mesher__mean_size(share, size, 8);
}

/* The barycentric coordinates of x in the tetrahedron with corners p, not normalised: w[i] is six
 * times the signed volume that x makes with the facet opposite corner i. */
static inline void mesher__weights_of(const double *const *p, const double *x, double *w)
{
    double d[4][3], ab, ac, ad, bc, bd, cd; /* minors of the first two columns */
    int i, j;
    for (i = 0; i < 4; i++)
        for (j = 0; j < 3; j++) d[i][j] = p[i][j] - x[j];
    ab = d[0][0] * d[1][1] - d[0][1] * d[1][0];
    ac = d[0][0] * d[2][1] - d[0][1] * d[2][0];
    ad = d[0][0] * d[3][1] - d[0][1] * d[3][0];
    bc = d[1][0] * d[2][1] - d[1][1] * d[2][0];
    bd = d[1][0] * d[3][1] - d[1][1] * d[3][0];
    cd = d[2][0] * d[3][1] - d[2][1] * d[3][0];
    w[0] = d[1][2] * cd - d[2][2] * bd + d[3][2] * bc;
    w[1] = -(d[0][2] * cd - d[2][2] * ad + d[3][2] * ac);
    w[2] = d[0][2] * bd - d[1][2] * ad + d[3][2] * ab;
    w[3] = -(d[0][2] * bc - d[1][2] * ac + d[2][2] * ab);
}

/* Is x in the bounding box of the corners, with some margin? If so, the rounded weights are
 * reliable. */
static int mesher__is_among(const double *const *p, const double *x)
{
    int i, k;
    for (k = 0; k < 3; k++) {
        double lo = p[0][k], hi = lo, margin;
        for (i = 1; i < 4; i++) {
            lo = p[i][k] < lo ? p[i][k] : lo;
            hi = p[i][k] > hi ? p[i][k] : hi;
        }
        margin = 1e-3 * (hi - lo);
        if (x[k] < lo - margin || x[k] > hi + margin) return 0;
    }
    return 1;
}

/* -- a size mesh: its tetrahedra along the Hilbert curve, below a tree of bounding boxes */

typedef struct mesher__size_tree {
    delaunay_memory memory;
    uint32_t       *order; /* of the tetrahedra; each leaf has MESHER__LEAF_ITEMS of them */
    mesher__bounds *nodes; /* 2*num_leaf_nodes; [0] unused */
    size_t          num_leaf_nodes;
    double          origin[3], scale;
} mesher__size_tree;

MESHER_API void mesher_size_mesh_free(mesher_size_mesh *mesh)
{
    mesher__size_tree *tree = mesh ? (mesher__size_tree *)mesh->tree : NULL;
    delaunay_memory memory;
    if (!tree) return;
    memory = tree->memory;
    delaunay_release(&memory, tree->order);
    delaunay_release(&memory, tree->nodes);
    delaunay_release(&memory, tree);
    mesh->tree = NULL;
}

/* Sets the order and the boxes of a size mesh whose tetrahedra have been checked. */
static mesher_result mesher__size_tree_set(const mesher_size_mesh *mesh, mesher__size_tree *tree,
                                           int num_threads)
{
    delaunay_memory *memory = &tree->memory;
    const size_t n = mesh->num_tets;
    mesher_result result = MESHER_ERROR_OUT_OF_MEMORY;
    double *middles = (double *)delaunay_alloc(memory, n, 3 * sizeof *middles);
    hxtsort_pair *pairs = (hxtsort_pair *)delaunay_alloc(memory, n, sizeof *pairs);
    size_t i;
    tree->num_leaf_nodes = mesher__leaf_nodes(n);
    tree->order = (uint32_t *)delaunay_alloc(memory, n, sizeof *tree->order);
    tree->nodes =
        (mesher__bounds *)delaunay_alloc(memory, 2 * tree->num_leaf_nodes, sizeof *tree->nodes);
    if (middles && pairs && tree->order && tree->nodes) {
        for (i = 0; i < n; i++)
            mesher__centroid_of(mesh->xyz, mesh->tets + 4 * i, 4, middles + 3 * i);
        result = mesher__order_points(memory, num_threads, middles, n, pairs);
    }
    for (i = 0; result == MESHER_OK && i < 2 * tree->num_leaf_nodes; i++)
        mesher__box_clear(tree->nodes + i);
    for (i = 0; result == MESHER_OK && i < n; i++) {
        const uint32_t t = (uint32_t)pairs[i].value;
        mesher__bounds box = mesher__box_around(mesh->xyz, mesh->tets + 4 * (size_t)t, 4,
                                                tree->origin, tree->scale);
        tree->order[i] = t;
        mesher__box_join(tree->nodes + tree->num_leaf_nodes + i / MESHER__LEAF_ITEMS, &box);
    }
    if (result == MESHER_OK) mesher__join_leaves(tree->nodes, tree->num_leaf_nodes);
    delaunay_release(memory, pairs);
    delaunay_release(memory, middles);
    return result;
}

/* Says in the report what is wrong with corner i of the tetrahedra of a size mesh. */
static mesher_result mesher__bad_size_mesh(const mesher_size_mesh *mesh, size_t i, const char *what,
                                           mesher_report *report)
{
    char text[160];
    snprintf(text, sizeof text,
             "invalid argument: tetrahedron %lu of the size mesh has vertex %lu, which %s",
             (unsigned long)(i / 4), (unsigned long)mesh->tets[i], what);
    mesher__say(report, text);
    return MESHER_ERROR_INVALID_ARGUMENT;
}

/* Checks the arrays of a size mesh, and sets lo and hi to the box of its tetrahedra. */
static mesher_result mesher__check_size_mesh(const mesher_size_mesh *mesh, double *lo, double *hi,
                                             mesher_report *report)
{
    size_t i;
    int k;
    if (!mesh->xyz || !mesh->tets || !mesh->size || mesh->num_tets == 0) {
        mesher__say(report, "invalid argument: the size mesh has no tetrahedra or no sizes");
        return MESHER_ERROR_INVALID_ARGUMENT;
    }
    if (mesh->num_tets > UINT32_MAX) return MESHER_ERROR_TOO_LARGE;
    for (i = 0; i < 4 * mesh->num_tets; i++) {
        const uint32_t v = mesh->tets[i];
        if (v >= mesh->num_vertices)
            return mesher__bad_size_mesh(mesh, i, "does not exist", report);
        for (k = 0; k < 3; k++) {
            const double x = mesh->xyz[3 * (size_t)v + (size_t)k];
            if (!(fabs(x) <= MESHER__LARGEST_COORDINATE))
                return mesher__bad_size_mesh(mesh, i, "is not within 1e60 of 0", report);
            if (i == 0 || x < lo[k]) lo[k] = x;
            if (i == 0 || x > hi[k]) hi[k] = x;
        }
    }
    return MESHER_OK;
}

MESHER_API mesher_result mesher_size_mesh_init(mesher_size_mesh *mesh, const delaunay_host *host,
                                               mesher_report *report)
{
    mesher__size_tree tree, *kept = NULL;
    mesher_result result;
    double hi[3], extent = 0;
    int k;
    memset(&tree, 0, sizeof tree);
    if (!mesh) {
        mesher__say(report, "invalid argument: no size mesh");
        return MESHER_ERROR_INVALID_ARGUMENT;
    }
    mesher_size_mesh_free(mesh);
    result = (mesher_result)delaunay_memory_init(&tree.memory, host);
    mesher__say(report, result == MESHER_OK ? "" : "invalid argument: the host");
    if (result == MESHER_OK) result = mesher__check_size_mesh(mesh, tree.origin, hi, report);
    if (result == MESHER_ERROR_TOO_LARGE) mesher__say(report, mesher_result_string(result));
    if (result != MESHER_OK) return result;
    for (k = 0; k < 3; k++)
        if (hi[k] - tree.origin[k] > extent) extent = hi[k] - tree.origin[k];
    if (extent < MESHER__SMALLEST_EXTENT) {
        mesher__say(report, "invalid argument: the extent of the size mesh is below 1e-60");
        return MESHER_ERROR_INVALID_ARGUMENT;
    }
    tree.scale = 1 / extent;
    result = mesher__size_tree_set(mesh, &tree, host ? host->num_threads : 0);
    if (result == MESHER_OK) {
        kept = (mesher__size_tree *)delaunay_alloc(&tree.memory, 1, sizeof *kept);
        if (!kept) result = MESHER_ERROR_OUT_OF_MEMORY;
    }
    if (kept) {
        *kept = tree;
        mesh->tree = kept;
    } else {
        delaunay_release(&tree.memory, tree.order);
        delaunay_release(&tree.memory, tree.nodes);
        mesher__say(report, mesher_result_string(result));
    }
    return result;
}

/* The corners of tetrahedron t of a size mesh, and their sizes. */
static void mesher__size_corners(const mesher_size_mesh *mesh, uint32_t t, const double **p,
                                 double *size)
{
    int k;
    for (k = 0; k < 4; k++) {
        const size_t v = mesh->tets[4 * (size_t)t + (size_t)k];
        p[k] = mesh->xyz + 3 * v;
        size[k] = mesh->size[v];
    }
}

/* Whether x is in a tetrahedron that is not flat; if so, w becomes the weights of its corners. */
static int mesher__is_in_tet(const double *const *p, const double *x, double *w)
{
    double volume, box = 1;
    int i, k;
    if (!mesher__is_among(p, x)) return 0;
    mesher__weights_of(p, x, w);
    volume = w[0] + w[1] + w[2] + w[3];
    for (k = 0; k < 3; k++) {
        double most = 0;
        for (i = 1; i < 4; i++) most = fmax(most, fabs(p[i][k] - p[0][k]));
        box *= most;
    }
    if (!(fabs(volume) > 1e-13 * box)) return 0; /* or all of it is rounding */
    for (i = 0; i < 4; i++) {
        w[i] /= volume;
        if (w[i] < 0) return 0;
    }
    return 1;
}

/* The distance from x to a tetrahedron that it is not in; w: weights of its corners at the nearest
 * place. */
static double mesher__tet_distance(const double *const *p, const double *x, double *w)
{
    double best = DBL_MAX, of_facet[3];
    int i, k;
    for (i = 0; i < 4; i++) {
        double d = mesher__triangle_distance(p[(i + 1) & 3], p[(i + 2) & 3], p[(i + 3) & 3], x,
                                             of_facet);
        if (d >= best) continue;
        best = d;
        w[i] = 0;
        for (k = 0; k < 3; k++) w[(i + 1 + k) & 3] = of_facet[k];
    }
    return best;
}

/* The distance from a place to a box, both in the tree's units. */
static double mesher__distance_to_box(const double *at, const mesher__bounds *box)
{
    double sum = 0;
    int k;
    for (k = 0; k < 3; k++) {
        const float x = mesher__rounded(at[k]);
        const double d = x < box->lo[k] ? (double)box->lo[k] - at[k]
                       : x > box->hi[k] ? at[k] - (double)box->hi[k] : 0;
        sum += d * d;
    }
    return sqrt(sum);
}

/* Finds a tetrahedron of a size mesh that x is in. Returns 0 if there is none, else sets the size
 * at x. */
static int mesher__size_within(const mesher_size_mesh *mesh, const double *x, const double *at,
                               double *size)
{
    const mesher__size_tree *tree = (const mesher__size_tree *)mesh->tree;
    mesher__bounds place;
    size_t stack[66], i;
    int top = 0, k;
    for (k = 0; k < 3; k++) place.lo[k] = place.hi[k] = mesher__rounded(at[k]);
    stack[top++] = 1;
    while (top) {
        const size_t node = stack[--top];
        if (!mesher__boxes_meet(&place, tree->nodes + node)) continue;
        if (node < tree->num_leaf_nodes) {
            stack[top++] = 2 * node + 1;
            stack[top++] = 2 * node;
            continue;
        }
        i = (node - tree->num_leaf_nodes) * MESHER__LEAF_ITEMS;
        for (k = 0; k < MESHER__LEAF_ITEMS && i < mesh->num_tets; k++, i++) {
            const double *p[4];
            double w[4], h[4];
            mesher__size_corners(mesh, tree->order[i], p, h);
            if (!mesher__is_in_tet(p, x, w)) continue;
            *size = mesher__mean_size(w, h, 4);
            return 1;
        }
    }
    return 0;
}

/* Searches the tetrahedra of a leaf for one that is nearer to x than *best. */
static void mesher__search_leaf(const mesher_size_mesh *mesh, size_t leaf, const double *x,
                                const double *at, double *best, double *size)
{
    const mesher__size_tree *tree = (const mesher__size_tree *)mesh->tree;
    const size_t end = (leaf + 1) * MESHER__LEAF_ITEMS;
    size_t i;
    for (i = leaf * MESHER__LEAF_ITEMS; i < end && i < mesh->num_tets; i++) {
        const uint32_t t = tree->order[i];
        const mesher__bounds box = mesher__box_around(mesh->xyz, mesh->tets + 4 * (size_t)t, 4,
                                                      tree->origin, tree->scale);
        const double *p[4];
        double w[4], h[4], d;
        if (mesher__distance_to_box(at, &box) >= *best * tree->scale) continue;
        mesher__size_corners(mesh, t, p, h);
        d = mesher__tet_distance(p, x, w);
        if (d >= *best) continue;
        *best = d;
        *size = mesher__mean_size(w, h, 4);
    }
}

/* The size at the place of the mesh that is nearest to x. */
static double mesher__size_nearest(const mesher_size_mesh *mesh, const double *x, const double *at)
{
    const mesher__size_tree *tree = (const mesher__size_tree *)mesh->tree;
    double best = DBL_MAX, size = 0, away[66];
    size_t stack[66];
    int top = 0, k;
    stack[0] = 1;
    away[top++] = 0;
    while (top && best > 0) {
        const size_t node = stack[--top];
        double d[2];
        if (away[top] >= best * tree->scale) continue;
        if (node >= tree->num_leaf_nodes) {
            mesher__search_leaf(mesh, node - tree->num_leaf_nodes, x, at, &best, &size);
            continue;
        }
        for (k = 0; k < 2; k++)
            d[k] = mesher__distance_to_box(at, tree->nodes + 2 * node + k);
        for (k = 0; k < 2; k++) { /* the nearer one last, to be searched first */
            const int child = (d[1] > d[0]) ^ k;
            stack[top] = 2 * node + (size_t)child;
            away[top++] = d[child];
        }
    }
    return size;
}

MESHER_API double mesher_size_mesh_at(const mesher_size_mesh *mesh, const double *x)
{
    const mesher__size_tree *tree = (const mesher__size_tree *)mesh->tree;
    double at[3], size;
    int k;
    for (k = 0; k < 3; k++) at[k] = (x[k] - tree->origin[k]) * tree->scale;
    return mesher__size_within(mesh, x, at, &size) ? size : mesher__size_nearest(mesh, x, at);
}

/* h, or the caller's size for this region if that is less. */
static double mesher__region_wish(const mesher_options *o, uint32_t region, double h)
{
    double wish;
    if (region < 1 || region > o->num_region_sizes) return h;
    wish = mesher__scaled(o, o->region_sizes[region - 1]);
    return wish > 0 && wish < h ? wish : h;
}

/* h, or the least of the caller's sizes at x (all but the function's) if that is less. */
static double mesher__wish_at(const mesher_options *o, const double *x, uint32_t region, double h)
{
    double wish;
    size_t i;
    h = mesher__region_wish(o, region, h);
    for (i = 0; i < o->num_sources; i++) {
        wish = mesher__scaled(o, mesher_source_size(o->sources + i, o->gradation, x));
        if (wish < h) h = wish;
    }
    wish = o->size_grid ? mesher__scaled(o, mesher_size_grid_at(o->size_grid, x)) : 0;
    if (wish > 0 && wish < h) h = wish;
    wish = o->size_mesh ? mesher__scaled(o, mesher_size_mesh_at(o->size_mesh, x)) : 0;
    return wish > 0 && wish < h ? wish : h;
}

/* Bounds a batch of sizes h by all of the caller's wishes but min_size, max_size and size. Returns
 * how many answers of the size function were no size. */
static uint64_t mesher__local_wishes(const mesher_options *o, size_t count, const double *xyz,
                                     const uint32_t *region, double *h)
{
    double wish[MESHER__BATCH];
    uint64_t ignored = 0;
    size_t first, i, n;
    for (first = 0; o->size_function && first < count; first += n) {
        n = count - first;
        if (n > MESHER__BATCH) n = MESHER__BATCH;
        for (i = 0; i < n; i++) wish[i] = 0;
        o->size_function(o->size_user, n, xyz + 3 * first, region + first, wish);
        for (i = 0; i < n; i++)
            if (!(wish[i] > 0)) ignored++;
            else h[first + i] = fmin(h[first + i], mesher__scaled(o, wish[i]));
    }
    for (i = 0; i < count; i++) h[i] = mesher__wish_at(o, xyz + 3 * i, region[i], h[i]);
    return ignored;
}

/* The same, and by those. */
static uint64_t mesher__wishes(const mesher_options *o, size_t count, const double *xyz,
                               const uint32_t *region, double *h)
{
    uint64_t ignored = mesher__local_wishes(o, count, xyz, region, h);
    size_t i;
    for (i = 0; i < count; i++) h[i] = mesher__clamp_size(o, h[i]);
    return ignored;
}

/* Bounds the sizes of the vertices v with of[v] != 0 by the caller's wishes (not by size and
 * max_size), in batches in the order of the vertices. Each is asked for as a point of region
 * of[v]. */
static uint64_t mesher__wish_as(mesher_domain *domain, const uint32_t *of)
{
    const delaunay_mesh *mesh = &domain->mesh;
    const mesher_options *o = &domain->options;
    double xyz[3 * MESHER__BATCH], h[MESHER__BATCH];
    uint32_t batch[MESHER__BATCH], region[MESHER__BATCH], v, n = 0, i;
    uint64_t ignored = 0;
    for (v = 1; v <= mesh->num_vertices; v++) {
        if (n == MESHER__BATCH || (v == mesh->num_vertices && n)) {
            ignored += mesher__local_wishes(o, n, xyz, region, h);
            for (i = 0; i < n; i++)
                domain->size[batch[i]] = h[i] < o->min_size ? o->min_size : h[i];
            n = 0;
        }
        if (v == mesh->num_vertices || !of[v] || !(domain->size[v] > 0)) continue;
        memcpy(xyz + 3 * n, mesh->vertices[v].x, 3 * sizeof *xyz);
        region[n] = of[v];
        h[n] = domain->size[v];
        batch[n++] = v;
    }
    return ignored;
}

/* Applies all of the caller's wishes at the vertices. A vertex between regions belongs to all of
 * them: region_sizes of each of them count, and the other wishes are asked for twice, with its
 * least and with its greatest region number. */
static mesher_result mesher__wish_at_vertices(mesher_domain *domain, uint64_t *ignored)
{
    delaunay_mesh *mesh = &domain->mesh;
    const mesher_options *o = &domain->options;
    uint32_t *least = (uint32_t *)delaunay_alloc_zeroed(&mesh->memory, mesh->num_vertices,
                                                        sizeof *least);
    uint32_t *greatest = (uint32_t *)delaunay_alloc_zeroed(&mesh->memory, mesh->num_vertices,
                                                           sizeof *greatest), v;
    delaunay_handle t;
    int i;
    for (t = 1; least && greatest && t < mesh->num_tets; t++)
        for (i = 0; i < 4 && mesher__is_inside(mesh, t); i++) {
            uint32_t color = mesh->color[t];
            v = mesh->tets[t].v[i];
            if (least[v] == 0 || color < least[v]) least[v] = color;
            if (color > greatest[v]) greatest[v] = color;
            if (color <= o->num_region_sizes && domain->size[v] > 0)
                domain->size[v] = mesher__region_wish(o, color, domain->size[v]);
        }
    if (least && greatest) {
        *ignored += mesher__wish_as(domain, least);
        for (v = 1; v < mesh->num_vertices; v++)
            if (greatest[v] == least[v]) greatest[v] = 0;
        *ignored += mesher__wish_as(domain, greatest);
    }
    delaunay_release(&mesh->memory, least);
    delaunay_release(&mesh->memory, greatest);
    return least && greatest ? MESHER_OK : MESHER_ERROR_OUT_OF_MEMORY;
}

/* The inward unit normal of facet i of tetrahedron t, and the facet's centroid. Returns 0 if the
 * facet has no normal. */
static int mesher__inward(const delaunay_mesh *mesh, delaunay_handle t, int i, double *n,
                          double *middle)
{
    const uint8_t *f = delaunay_facet_order(i);
    const double *a = mesh->vertices[mesh->tets[t].v[f[0]]].x,
                 *b = mesh->vertices[mesh->tets[t].v[f[1]]].x;
    const double *c = mesh->vertices[mesh->tets[t].v[f[2]]].x;
    const double l = mesher__normal(a, c, b, n);
    int k;
    for (k = 0; k < 3; k++) middle[k] = (a[k] + b[k] + c[k]) / 3;
    for (k = 0; k < 3 && l > 0; k++) n[k] /= l;
    return l > 0;
}

/* Follows a ray that enters tetrahedron *t through facet *i at x, until it meets a constrained
 * facet; *t and *i are then that facet. Returns its distance, or -1 if there is none. */
static double mesher__cast(const delaunay_mesh *mesh, const double *x, const double *ray,
                           delaunay_handle *t, int *i)
{
    double n[3], middle[3];
    int step, j, k;
    for (step = 0; step < 1000; step++) {
        double nearest = 1e300;
        int exit = -1;
        for (j = 0; j < 4; j++) {
            double along = 0, away = 0;
            if (j == *i || !mesher__inward(mesh, *t, j, n, middle)) continue;
            for (k = 0; k < 3; k++) {
                along -= n[k] * ray[k];
                away -= n[k] * (middle[k] - x[k]);
            }
            if (!(along > 1e-12)) continue;
            if (away < nearest * along) {
                nearest = away / along;
                exit = j;
            }
        }
        if (exit < 0) return -1;
        *i = exit;
        if ((mesh->flags[*t] & DELAUNAY_FACET_BIT(exit)) || !mesh->tets[*t].n[exit])
            return nearest > 0 ? nearest : -1;
        j = (int)(mesh->tets[*t].n[exit] & 3);
        *t = mesh->tets[*t].n[exit] >> 2;
        *i = j;
        if (!mesher__is_inside(mesh, *t)) return -1;
    }
    return -1;
}

static void mesher__at_most(double *size, double h)
{
    if (h > 0 && h < *size) *size = h;
}

/* Is facet i of tetrahedron t, which is inside, on the surface? Fills in its inward normal and its
 * centroid. */
static int mesher__on_surface(const delaunay_mesh *mesh, delaunay_handle t, int i, double *n,
                              double *middle)
{
    return (!mesh->tets[t].n[i] || (mesh->flags[t] & DELAUNAY_FACET_BIT(i))) &&
           mesher__inward(mesh, t, i, n, middle);
}

/* The longest edge of facet i of t. */
static double mesher__facet_extent(const delaunay_mesh *mesh, delaunay_handle t, int i)
{
    const uint8_t *f = delaunay_facet_order(i);
    double longest = 0;
    int k;
    for (k = 0; k < 3; k++) {
        double l = mesher__distance(mesh->vertices[mesh->tets[t].v[f[k]]].x,
                                    mesh->vertices[mesh->tets[t].v[f[(k + 1) % 3]]].x);
        longest = l > longest ? l : longest;
    }
    return longest;
}

/* Do facets i of t and j of u share a vertex? */
static int mesher__facets_touch(const delaunay_mesh *mesh, delaunay_handle t, int i,
                                delaunay_handle u, int j)
{
    int k, l, touch = 0;
    for (k = 0; k < 4; k++)
        for (l = 0; l < 4; l++)
            touch |= k != i && l != j && mesh->tets[t].v[k] == mesh->tets[u].v[l];
    return touch;
}

/* The distance from facet i of t, which is inside, to the surface opposite, along a ray from its
 * centroid x in the direction of its inward normal n. *met and *j: the facet that the ray meets.
 * Returns -1 if facet i is not on the surface or the ray meets nothing. A facet that shares a
 * vertex with it, at a sharp edge, does not count as opposite: there is no room for layers. */
static double mesher__gap(const delaunay_mesh *mesh, delaunay_handle t, int i, double *n,
                          double *x, delaunay_handle *met, int *j)
{
    double gap;
    if (!mesher__on_surface(mesh, t, i, n, x)) return -1;
    *met = t;
    *j = i;
    gap = mesher__cast(mesh, x, n, met, j);
    return mesher__facets_touch(mesh, t, i, *met, *j) ? -1 : gap;
}

/* Bounds the sizes at the corners of facet i of t by h, and that of the fourth corner of t if this
 * is a point of recovery. */
static void mesher__facet_at_most(mesher_domain *domain, delaunay_handle t, int i, double h)
{
    const delaunay_mesh *mesh = &domain->mesh;
    int k;
    for (k = 0; k < 4; k++) {
        uint32_t v = mesh->tets[t].v[k];
        if (k != i || mesh->vertex_id[v] == DELAUNAY_NO_ID) mesher__at_most(domain->size + v, h);
    }
}

/* Bounds the sizes at each facet by its distance from the facet opposite, divided by the number of
 * layers, but not by less than its longest edge times least. */
static void mesher__gap_sizes(mesher_domain *domain, double least)
{
    const delaunay_mesh *mesh = &domain->mesh;
    delaunay_handle t, met;
    double n[3], x[3], h, lowest;
    int i, j;
    for (t = 1; t < mesh->num_tets; t++)
        for (i = 0; i < 4 && mesher__is_inside(mesh, t); i++) {
            h = mesher__gap(mesh, t, i, n, x, &met, &j) / domain->options.layers;
            if (!(h > 0)) continue;
            lowest = least * mesher__facet_extent(mesh, t, i);
            if (h < lowest) h = lowest;
            mesher__facet_at_most(domain, t, i, h);
            mesher__facet_at_most(domain, met, j, h);
        }
}

/* The facets of the surface as seen from within the regions: one between two regions is listed
 * twice, once with each normal. With a list of the facets at each vertex. */
typedef struct mesher__fans {
    uint32_t num;
    double   *normal; /* 3 each, of length 1, inwards */
    uint32_t *corner; /* 3 each */
    uint32_t *first;  /* the facets at vertex v: list[first[v]] .. list[first[v + 1] - 1] */
    uint32_t *list;
} mesher__fans;

static void mesher__fans_free(mesher__fans *fans, delaunay_memory *memory)
{
    delaunay_release(memory, fans->normal);
    delaunay_release(memory, fans->corner);
    delaunay_release(memory, fans->first);
    delaunay_release(memory, fans->list);
}

static mesher_result mesher__fans_init(mesher__fans *fans, const delaunay_mesh *mesh,
                                       delaunay_memory *memory)
{
    size_t num = 0, f = 0, k;
    double n[3], middle[3];
    delaunay_handle t;
    int i, j;
    memset(fans, 0, sizeof *fans);
    for (t = 1; t < mesh->num_tets; t++)
        for (i = 0; i < 4 && mesher__is_inside(mesh, t); i++)
            num += mesher__on_surface(mesh, t, i, n, middle) ? 1 : 0;
    if (num >= UINT32_MAX / 3) return MESHER_ERROR_TOO_LARGE;
    fans->num = (uint32_t)num;
    fans->normal = (double *)delaunay_alloc(memory, num, 3 * sizeof *fans->normal);
    fans->corner = (uint32_t *)delaunay_alloc(memory, num, 3 * sizeof *fans->corner);
    fans->list = (uint32_t *)delaunay_alloc(memory, num, 3 * sizeof *fans->list);
    fans->first = (uint32_t *)delaunay_alloc_zeroed(memory, (size_t)mesh->num_vertices + 2,
                                                    sizeof *fans->first);
    if (!fans->normal || !fans->corner || !fans->list || !fans->first)
        return MESHER_ERROR_OUT_OF_MEMORY;
    for (t = 1; t < mesh->num_tets; t++)
        for (i = 0; i < 4 && mesher__is_inside(mesh, t); i++) {
            if (!mesher__on_surface(mesh, t, i, n, middle)) continue;
            memcpy(fans->normal + 3 * f, n, sizeof n);
            for (j = 0; j < 3; j++) {
                uint32_t v = mesh->tets[t].v[delaunay_facet_order(i)[j]];
                fans->corner[3 * f + (size_t)j] = v;
                fans->first[v + 2]++;
            }
            f++;
        }
    for (k = 2; k < (size_t)mesh->num_vertices + 2; k++) fans->first[k] += fans->first[k - 1];
    for (k = 0; k < 3 * num; k++) /* first[v + 1] moves from the start of v's facets to their end */
        fans->list[fans->first[fans->corner[k] + 1]++] = (uint32_t)(k / 3);
    return MESHER_OK;
}

enum { MESHER__FAN = 1000 }; /* a vertex with more facets is a hub: too many to visit for each */

/* The sum of the normals of the facets around vertex v of facet f, without those beyond a crease,
 * such as the other side of the surface. At a hub, the normal of f alone. */
static void mesher__fan_normal(const mesher__fans *fans, uint32_t f, uint32_t v, double crease,
                               double *sum)
{
    const double *own = fans->normal + 3 * (size_t)f;
    uint32_t k, first = fans->first[v], end = fans->first[v + 1];
    if (end - first > MESHER__FAN) {
        memcpy(sum, own, 3 * sizeof *sum);
        return;
    }
    memset(sum, 0, 3 * sizeof *sum);
    for (k = first; k < end; k++) {
        const double *n = fans->normal + 3 * (size_t)fans->list[k];
        if (n[0] * own[0] + n[1] * own[1] + n[2] * own[2] < crease) continue;
        sum[0] += n[0], sum[1] += n[1], sum[2] += n[2];
    }
}

/* Bounds the sizes at the ends of an edge by the angle between the surface normals at both ends.
 * Each facet at it is looked at by itself, with normals that leave out what is beyond a crease. */
static mesher_result mesher__curvature_sizes(mesher_domain *domain)
{
    const double crease = cos(45 * 3.14159265358979323846 / 180);
    const double most = domain->options.curvature_degrees * 3.14159265358979323846 / 180;
    const delaunay_mesh *mesh = &domain->mesh;
    mesher__fans fans;
    mesher_result result = mesher__fans_init(&fans, mesh, &domain->memory);
    uint32_t f;
    int i;
    for (f = 0; result == MESHER_OK && f < fans.num; f++) {
        const uint32_t *v = fans.corner + 3 * (size_t)f;
        double n[3][3];
        for (i = 0; i < 3; i++) mesher__fan_normal(&fans, f, v[i], crease, n[i]);
        for (i = 0; i < 3; i++) {
            const double *p = n[i], *q = n[(i + 1) % 3];
            uint32_t a = v[i], b = v[(i + 1) % 3];
            double pp = p[0] * p[0] + p[1] * p[1] + p[2] * p[2], h,
                   qq = q[0] * q[0] + q[1] * q[1] + q[2] * q[2],
                   cosine = (p[0] * q[0] + p[1] * q[1] + p[2] * q[2]) / sqrt(pp * qq);
            if (!(cosine >= crease) || cosine > 1 - 1e-12) continue;
            h = most / acos(cosine) * mesher__distance(mesh->vertices[a].x, mesh->vertices[b].x);
            mesher__at_most(domain->size + a, h);
            mesher__at_most(domain->size + b, h);
        }
    }
    mesher__fans_free(&fans, &domain->memory);
    return result;
}

/* Bounds the size of vertex v by that of vertex `by` plus most. Returns whether that changed it. */
static int mesher__limit_size(mesher_domain *domain, uint32_t v, uint32_t by, double most)
{
    if (!(domain->size[v] > (1 + 1e-9) * (domain->size[by] + most))) return 0;
    domain->size[v] = domain->size[by] + most;
    domain->size_source[v] = domain->size_source[by];
    return 1;
}

/* Lowers sizes to size and max_size, and until those of vertices that share a tetrahedron differ by
 * no more than the gradation allows. A sweep carries a bound at least one edge further. After
 * SWEEPS of them and SWEPT_TETS tetrahedra (a second or two) it ends anyway: bounds reach so far
 * only where sizes grow by a thousandth from edge to edge. */
#  define MESHER__SWEEPS     100
#  define MESHER__SWEPT_TETS 1e8
static mesher_result mesher__limit_gradation(mesher_domain *domain)
{
    const delaunay_mesh *mesh = &domain->mesh;
    const double slope = mesher__slope(&domain->options), cap = mesher__size_cap(&domain->options);
    double *size = domain->size;
    delaunay_handle t;
    uint32_t v;
    int sweep, e, changed = 1;
    delaunay_release(&domain->memory, domain->own_size);
    delaunay_release(&domain->memory, domain->size_source);
    domain->own_size =
        (double *)delaunay_alloc(&domain->memory, mesh->num_vertices, sizeof *domain->own_size);
    domain->size_source = (uint32_t *)delaunay_alloc(&domain->memory, mesh->num_vertices,
                                                     sizeof *domain->size_source);
    if (!domain->own_size || !domain->size_source) return MESHER_ERROR_OUT_OF_MEMORY;
    memcpy(domain->own_size, size, mesh->num_vertices * sizeof *size);
    domain->num_own_sizes = mesh->num_vertices;
    for (v = 0; v < mesh->num_vertices; v++) {
        domain->size_source[v] = v;
        if (size[v] > cap) size[v] = cap;
    }
    for (sweep = 0; changed && (sweep < MESHER__SWEEPS ||
                                (double)sweep * (double)mesh->num_tets < MESHER__SWEPT_TETS);
         sweep++)
        for (changed = 0, t = 1; t < mesh->num_tets; t++) {
            if (!mesher__is_inside(mesh, t)) continue;
            for (e = 0; e < 6; e++) {
                uint32_t a = mesh->tets[t].v[delaunay_edge_order(e)[0]],
                         b = mesh->tets[t].v[delaunay_edge_order(e)[1]];
                double most;
                if (!(size[a] > 0) || !(size[b] > 0)) continue;
                most = slope * mesher__distance(mesh->vertices[a].x, mesh->vertices[b].x);
                changed |= mesher__limit_size(domain, a, b, most) ||
                           mesher__limit_size(domain, b, a, most);
            }
        }
    return MESHER_OK;
}

/* Computes the sizes at the vertices; those for layers are at least least_layer times as long as
 * the facets' edges. */
static mesher_result mesher__find_sizes(mesher_domain *domain, double least_layer,
                                        mesher_report *report)
{
    delaunay_mesh *mesh;
    double start, least;
    mesher_result result = MESHER_OK;
    uint64_t ignored = 0;
    uint32_t v;
    if (!mesher__is_colored(domain)) return MESHER_ERROR_INVALID_ARGUMENT;
    start = delaunay_seconds(&domain->options.host);
    mesh = &domain->mesh;
    if (domain->cap_size < mesh->cap_vertices) {
        double *size = (double *)delaunay_alloc(&domain->memory, mesh->cap_vertices, sizeof *size);
        if (!size) return MESHER_ERROR_OUT_OF_MEMORY;
        delaunay_release(&domain->memory, domain->size);
        domain->size = size;
        domain->cap_size = mesh->cap_vertices;
    }
    result = mesher__edge_sizes(domain);
    if (result == MESHER_OK) result = mesher__spread_sizes(domain);
    if (result == MESHER_OK && domain->options.layers > 0)
        mesher__gap_sizes(domain, least_layer);
    if (result == MESHER_OK && domain->options.curvature_degrees > 0)
        result = mesher__curvature_sizes(domain);
    if (result == MESHER_OK) result = mesher__wish_at_vertices(domain, &ignored);
    if (result == MESHER_OK) result = mesher__limit_gradation(domain);
    if (result != MESHER_OK) return result;
    domain->num_sizes = mesh->num_vertices;
    least = mesher__size_floor(mesh);
    for (v = 1; v < mesh->num_vertices; v++)
        if (domain->size[v] > 0 && domain->size[v] < least) domain->size[v] = least;
    if (report) {
        report->size_ignored = ignored;
        report->seconds_size = delaunay_seconds(&domain->options.host) - start;
    }
    return MESHER_OK;
}

/* Where two large facets nearly touch, layers between them would be so many tetrahedra that they
 * take minutes, all flat on such facets. */
#  define MESHER__LEAST_LAYER (1.0 / 64)

MESHER_API mesher_result mesher_size(mesher_domain *domain, mesher_report *report)
{
    if (!mesher__enter(report, mesher__is_colored(domain))) return MESHER_ERROR_INVALID_ARGUMENT;
    return mesher__find_sizes(domain, MESHER__LEAST_LAYER, report);
}

/* A vertex of the background, with all that the field needs of it. */
typedef struct mesher__field_vertex {
    double   x[3], size; /* domain->size; these four are loaded as one vector */
    double   own;        /* domain->own_size */
    uint32_t source;    /* domain->size_source */
} mesher__field_vertex;

/* A vertex from which sizes grow into a region. One at several regions is there for each of them.
 */
typedef struct mesher__growth_item {
    double   x[3], size;
    uint32_t region;
} mesher__growth_item;

/* What items have in common: a box around them, a lower bound of their sizes, their first and last
 * region. */
typedef struct mesher__growth_node {
    mesher__bounds box;
    float          least;
    uint32_t       first, last;
} mesher__growth_node;

/* The vertices from which sizes grow, by regions, and in each along the Hilbert curve, below a tree
 * such as that of mesher__space. */
typedef struct mesher__growth {
    mesher__growth_item *items;
    mesher__growth_node *nodes; /* 2*num_leaf_nodes; [0] unused */
    size_t               num_items, num_leaf_nodes;
    double               origin[3], scale;
} mesher__growth;

/* The size field, as it stays while points are inserted. */
typedef struct mesher__field {
    const mesher_options *options;
    /* the background: the mesh before refinement; in place of ghosts, neighbours are 0 */
    mesher__field_vertex *vertices;
    delaunay_tet         *tets;
    uint32_t             *color;
    uint32_t              num_vertices;
    mesher__growth        growth; /* empty without options.growth */
    double                slope, least, cap;
    int                   simd; /* the processor has AVX2 */
} mesher__field;

static void mesher__weights(const delaunay_vertex *vertices, const uint32_t *v, const double *x,
                            double *w)
{
    const double *p[4];
    int i;
    for (i = 0; i < 4; i++) p[i] = vertices[v[i]].x;
    mesher__weights_of(p, x, w);
}

/* The same with exact signs: if the tetrahedron is tiny and far from x, the weights of
 * mesher__weights_of are nothing but rounding. */
static void mesher__signed_weights(const double *const *p, const double *x, double *w)
{
    const double *q[4];
    int i;
    mesher__weights_of(p, x, w);
    memcpy(q, p, sizeof q);
    for (i = 0; i < 4; i++) {
        int sign;
        q[i] = x;
        sign = delaunay_orient3d(q[0], q[1], q[2], q[3]);
        q[i] = p[i];
        if ((w[i] > 0) - (w[i] < 0) != sign) w[i] = sign * DBL_MIN;
    }
}

enum { MESHER__SHORT = 30, MESHER__LONG = 1000 }; /* steps of walks in the background */

#if defined(__GNUC__) && defined(__x86_64__) && !defined(DELAUNAY_NO_SIMD)
#define MESHER__SIMD

/* The corners of a tetrahedron of the background: their coordinates and sizes. */
typedef struct mesher__corners {
    __m256d row[4]; /* x, y, z and size of each */
    __m256d x, y, z, size;
} mesher__corners;

__attribute__((target("avx2"))) static inline void
mesher__load_corners(mesher__corners *c, const mesher__field_vertex *vertices, const uint32_t *v)
{
    const __m256d r0 = _mm256_loadu_pd(vertices[v[0]].x), r1 = _mm256_loadu_pd(vertices[v[1]].x),
                  r2 = _mm256_loadu_pd(vertices[v[2]].x), r3 = _mm256_loadu_pd(vertices[v[3]].x),
                  s0 = _mm256_unpacklo_pd(r0, r1), s1 = _mm256_unpackhi_pd(r0, r1),
                  s2 = _mm256_unpacklo_pd(r2, r3), s3 = _mm256_unpackhi_pd(r2, r3);
    c->row[0] = r0;
    c->row[1] = r1;
    c->row[2] = r2;
    c->row[3] = r3;
    c->x = _mm256_permute2f128_pd(s0, s2, 0x20);
    c->y = _mm256_permute2f128_pd(s1, s3, 0x20);
    c->z = _mm256_permute2f128_pd(s0, s2, 0x31);
    c->size = _mm256_permute2f128_pd(s1, s3, 0x31);
}

/* mesher__weights_of: the same operations, for all four weights at a time. The other three corners
 * than i, in ascending order, are p, q and r. */
__attribute__((target("avx2"))) static inline __m256d
mesher__weights_avx2(const mesher__corners *c, const double *at)
{
    enum { MESHER__P = 0x01, MESHER__Q = 0x5a, MESHER__R = 0xbf }; /* 1000, 2211, 3332 */
    const __m256d x = _mm256_sub_pd(c->x, _mm256_set1_pd(at[0])),
                  y = _mm256_sub_pd(c->y, _mm256_set1_pd(at[1])),
                  z = _mm256_sub_pd(c->z, _mm256_set1_pd(at[2])),
                  xp = _mm256_permute4x64_pd(x, MESHER__P),
                  xq = _mm256_permute4x64_pd(x, MESHER__Q),
                  xr = _mm256_permute4x64_pd(x, MESHER__R),
                  yp = _mm256_permute4x64_pd(y, MESHER__P),
                  yq = _mm256_permute4x64_pd(y, MESHER__Q),
                  yr = _mm256_permute4x64_pd(y, MESHER__R),
                  pq = _mm256_sub_pd(_mm256_mul_pd(xp, yq), _mm256_mul_pd(yp, xq)),
                  pr = _mm256_sub_pd(_mm256_mul_pd(xp, yr), _mm256_mul_pd(yp, xr)),
                  qr = _mm256_sub_pd(_mm256_mul_pd(xq, yr), _mm256_mul_pd(yq, xr));
    __m256d w = _mm256_sub_pd(_mm256_mul_pd(_mm256_permute4x64_pd(z, MESHER__P), qr),
                              _mm256_mul_pd(_mm256_permute4x64_pd(z, MESHER__Q), pr));
    w = _mm256_add_pd(w, _mm256_mul_pd(_mm256_permute4x64_pd(z, MESHER__R), pq));
    return _mm256_xor_pd(w, _mm256_setr_pd(0.0, -0.0, 0.0, -0.0));
}

/* mesher__is_among. */
__attribute__((target("avx2"))) static inline int mesher__is_among_avx2(const __m256d *row,
                                                                        const double *x)
{
    const __m256d at = _mm256_setr_pd(x[0], x[1], x[2], 0),
                  lo = _mm256_min_pd(_mm256_min_pd(row[0], row[1]), _mm256_min_pd(row[2], row[3])),
                  hi = _mm256_max_pd(_mm256_max_pd(row[0], row[1]), _mm256_max_pd(row[2], row[3])),
                  margin = _mm256_mul_pd(_mm256_set1_pd(1e-3), _mm256_sub_pd(hi, lo));
    const __m256d out =
        _mm256_or_pd(_mm256_cmp_pd(at, _mm256_sub_pd(lo, margin), _CMP_LT_OQ),
                     _mm256_cmp_pd(at, _mm256_add_pd(hi, margin), _CMP_GT_OQ));
    return (_mm256_movemask_pd(out) & 7) == 0;
}

/* The walk of mesher__find_home, as long as it is short and needs no exact signs. Returns 0 if that
 * is not enough. */
__attribute__((target("avx2"))) static delaunay_handle
mesher__find_near(const mesher__field *field, const double *x, delaunay_handle t, double *w)
{
    delaunay_handle from = 0;
    int step, i;
    for (step = 0; step < MESHER__SHORT; step++) {
        const delaunay_tet *tet = field->tets + t;
        mesher__corners corners;
        __m256d weights;
        int k = -1, out;
        mesher__load_corners(&corners, field->vertices, tet->v);
        weights = mesher__weights_avx2(&corners, x);
        _mm256_storeu_pd(w, weights);
        out = _mm256_movemask_pd(_mm256_cmp_pd(weights, _mm256_setzero_pd(), _CMP_LT_OQ));
        for (i = 0; i < 4 && out; i++) {
            int j = (i + step) & 3;
            if (!(out >> j & 1) || !tet->n[j] || tet->n[j] >> 2 == from) continue;
            if (k < 0 || w[j] < w[k]) k = j;
        }
        if (k < 0) return mesher__is_among_avx2(corners.row, x) ? t : 0;
        from = t;
        t = tet->n[k] >> 2;
    }
    return 0;
}
#endif

/* The background's tetrahedron that contains x, by a walk from t, which is near; w: weights of its
 * corners, not negative, with the sum 1. Rounding may end the walk in a neighbour; as the field is
 * continuous, so is the answer. To avoid cycles, the walk does not go straight back, and each step
 * tries the facets in another order. A walk that is long, or ends far from x, goes on by exact
 * signs; after MESHER__LONG steps it gives up where it is. */
static delaunay_handle mesher__find_home(const mesher__field *field, const double *x,
                                         delaunay_handle t, double *w, int *found)
{
    delaunay_handle from = 0;
    const double *p[4];
    double sum = 0, least = 0;
    int step = 0, i, exact = 0;
#ifdef MESHER__SIMD
    if (field->simd) {
        const delaunay_handle end = mesher__find_near(field, x, t, w);
        if (end) {
            t = end;
            step = MESHER__LONG;
        }
    }
#endif
    for (; step < MESHER__LONG; step++) {
        const delaunay_tet *tet = field->tets + t;
        const unsigned first =
            step < MESHER__SHORT ? (unsigned)step : (unsigned)step * 0x9E3779B1u >> 30;
        int k = -1;
        for (i = 0; i < 4; i++) p[i] = field->vertices[tet->v[i]].x;
        exact |= step >= MESHER__SHORT;
        if (exact) mesher__signed_weights(p, x, w);
        else mesher__weights_of(p, x, w);
        for (i = 0; i < 4; i++) {
            int j = (int)((unsigned)i + first) & 3;
            if (w[j] >= 0 || !tet->n[j] || (!exact && tet->n[j] >> 2 == from)) continue;
            if (k < 0 || (step < MESHER__SHORT && w[j] < w[k])) k = j;
        }
        if (k < 0 && (exact || mesher__is_among(p, x))) break;
        from = t;
        if (k < 0) exact = 1;
        else t = tet->n[k] >> 2;
    }
    for (i = 0; i < 4; i++) {
        if (w[i] < least) least = w[i];
        if (!(w[i] > 0)) w[i] = 0;
        sum += w[i];
    }
    *found = least > -1e-6 * sum;
    for (i = 0; i < 4; i++) w[i] = sum > 0 ? w[i] / sum : 0.25;
    return t;
}

/* The sizes at the corners of a tetrahedron of the background that are to be interpolated. Returns
 * 0 if the gradation bounded none of them, or options.growth is in use: they are those of the
 * vertices. Otherwise they are the sizes before the gradation, bounded by each other only; *most is
 * lowered to what the vertices whose sizes bounded them allow at x. */
static int mesher__corner_sizes(const mesher__field *field, const uint32_t *v, const double *x,
                                double *size, double *most)
{
    const mesher__field_vertex *vertices = field->vertices, *source;
    int i, j, bounded = 0;
    for (i = 0; i < 4; i++) {
        size[i] = vertices[v[i]].size;
        bounded |= size[i] > 0 && vertices[v[i]].own > (1 + 1e-9) * size[i];
    }
    if (!bounded || field->options->growth > 1) return 0;
    for (i = 0; i < 4; i++)
        if (size[i] > 0 && vertices[v[i]].own > size[i]) size[i] = vertices[v[i]].own;
    for (i = 0; i < 4; i++) {
        double d;
        if (!(size[i] > 0)) continue;
        source = vertices + vertices[v[i]].source;
        d = mesher__distance(source->x, x);
        if (*most > source->size + field->slope * d) *most = source->size + field->slope * d;
        for (j = 0; j < 4; j++) {
            if (!(size[j] > size[i])) continue;
            d = mesher__distance(vertices[v[i]].x, vertices[v[j]].x);
            if (size[j] > size[i] + field->slope * d) size[j] = size[i] + field->slope * d;
        }
    }
    return 1;
}

/* A size, but no less than the field's floor. */
static inline double mesher__floored(const mesher__field *field, double h)
{
    return h > field->least ? h : field->least;
}

/* -- sizes that grow from all vertices of a region. (The corners of the background's tetrahedron
 * around a place do not suffice: before refinement it may span the region, and all be far away.) */

static void mesher__growth_free(delaunay_memory *memory, mesher__growth *g)
{
    delaunay_release(memory, g->items);
    delaunay_release(memory, g->nodes);
    memset(g, 0, sizeof *g);
}

/* The vertices of the regions, in any order; with items NULL only their number. `last` has room for
 * a region of each vertex. */
static size_t mesher__growth_gather(const mesher_domain *domain, uint32_t *last,
                                    mesher__growth_item *items)
{
    const delaunay_mesh *mesh = &domain->mesh;
    delaunay_handle t;
    size_t n = 0;
    int i;
    memset(last, 0, mesh->num_vertices * sizeof *last);
    for (t = 1; t < mesh->num_tets; t++) {
        if (!mesher__is_inside(mesh, t)) continue;
        for (i = 0; i < 4; i++) {
            const uint32_t v = mesh->tets[t].v[i];
            if (last[v] == mesh->color[t] || !(domain->size[v] > 0)) continue;
            last[v] = mesh->color[t];
            if (items) {
                memcpy(items[n].x, mesh->vertices[v].x, sizeof items[n].x);
                items[n].size = domain->size[v];
                items[n].region = mesh->color[t];
            }
            n++;
        }
    }
    return n;
}

/* Sorts items by the curve and then by regions. */
static mesher_result mesher__growth_sort(const mesher_domain *domain, delaunay_memory *memory,
                                         const mesher__growth_item *items, size_t n,
                                         mesher__growth_item *sorted)
{
    const int threads = domain->options.host.num_threads;
    mesher_result result = MESHER_ERROR_OUT_OF_MEMORY;
    double *xyz = (double *)delaunay_alloc(memory, n, 3 * sizeof *xyz);
    hxtsort_pair *pairs = (hxtsort_pair *)delaunay_alloc(memory, n, sizeof *pairs);
    size_t i;
    if (xyz && pairs) {
        for (i = 0; i < n; i++) memcpy(xyz + 3 * i, items[i].x, sizeof items[i].x);
        result = mesher__order_points(memory, threads, xyz, n, pairs);
    }
    for (i = 0; i < n && result == MESHER_OK; i++) pairs[i].key = items[pairs[i].value].region;
    if (result == MESHER_OK) result = mesher__sort_pairs(memory, threads, pairs, n);
    for (i = 0; i < n && result == MESHER_OK; i++) sorted[i] = items[pairs[i].value];
    delaunay_release(memory, pairs);
    delaunay_release(memory, xyz);
    return result;
}

static void mesher__growth_join(mesher__growth_node *a, const mesher__growth_node *b)
{
    mesher__box_join(&a->box, &b->box);
    if (b->least < a->least) a->least = b->least;
    if (b->first < a->first) a->first = b->first;
    if (b->last > a->last) a->last = b->last;
}

static void mesher__growth_build(mesher__growth *g)
{
    size_t i;
    int k;
    for (i = 0; i < 2 * g->num_leaf_nodes; i++) {
        mesher__growth_node *node = g->nodes + i;
        mesher__box_clear(&node->box);
        node->least = FLT_MAX;
        node->first = UINT32_MAX;
        node->last = 0;
    }
    for (i = 0; i < g->num_items; i++) {
        const mesher__growth_item *item = g->items + i;
        mesher__growth_node node;
        for (k = 0; k < 3; k++)
            node.box.lo[k] = node.box.hi[k] =
                mesher__rounded((item->x[k] - g->origin[k]) * g->scale);
        node.least = mesher__rounded(item->size * g->scale);
        node.first = node.last = item->region;
        mesher__growth_join(g->nodes + g->num_leaf_nodes + i / MESHER__LEAF_ITEMS, &node);
    }
    for (i = g->num_leaf_nodes; i-- > 1;) {
        g->nodes[i] = g->nodes[2 * i];
        mesher__growth_join(g->nodes + i, g->nodes + 2 * i + 1);
    }
}

/* Makes the tree; box: a cube around all vertices. */
static mesher_result mesher__growth_init(mesher__growth *g, const mesher_domain *domain,
                                         delaunay_memory *memory, const hilbert_box *box)
{
    mesher_result result = MESHER_ERROR_OUT_OF_MEMORY;
    mesher__growth_item *items = NULL;
    uint32_t *last =
        (uint32_t *)delaunay_alloc(memory, domain->mesh.num_vertices, sizeof *last);
    const double extent = box->hi[0] - box->lo[0];
    memset(g, 0, sizeof *g);
    if (!last) goto done;
    g->num_items = mesher__growth_gather(domain, last, NULL);
    g->num_leaf_nodes = mesher__leaf_nodes(g->num_items);
    memcpy(g->origin, box->lo, sizeof g->origin);
    g->scale = extent > 0 ? 1 / extent : 1;
    items = (mesher__growth_item *)delaunay_alloc(memory, g->num_items, sizeof *items);
    g->items = (mesher__growth_item *)delaunay_alloc(memory, g->num_items, sizeof *g->items);
    g->nodes =
        (mesher__growth_node *)delaunay_alloc(memory, 2 * g->num_leaf_nodes, sizeof *g->nodes);
    if (!items || !g->items || !g->nodes) goto done;
    mesher__growth_gather(domain, last, items);
    result = mesher__growth_sort(domain, memory, items, g->num_items, g->items);
    if (result == MESHER_OK) mesher__growth_build(g);
done:
    delaunay_release(memory, items);
    delaunay_release(memory, last);
    if (result != MESHER_OK) mesher__growth_free(memory, g);
    return result;
}

/* The least size that the items of a region allow at x, or most if that is less; or a few percent
 * more, where many items allow about the same. */
#define MESHER__TOLERATED 1.1
static double mesher__grown_size(const mesher__growth *g, const double *x, uint32_t region,
                                 double slope, double most)
{
    double at[3], low[66];
    size_t stack[66], i;
    int top = 0, k;
    if (g->num_items == 0) return most;
    for (k = 0; k < 3; k++) at[k] = (x[k] - g->origin[k]) * g->scale;
    stack[0] = 1;
    low[top++] = 0;
    while (top) {
        const size_t node = stack[--top];
        double d[2];
        if (MESHER__TOLERATED * low[top] >= most * g->scale) continue;
        if (node >= g->num_leaf_nodes) {
            i = (node - g->num_leaf_nodes) * MESHER__LEAF_ITEMS;
            for (k = 0; k < MESHER__LEAF_ITEMS && i < g->num_items; k++, i++) {
                const mesher__growth_item *item = g->items + i;
                const double h = item->size + slope * mesher__distance(item->x, x);
                if (item->region == region && h < most) most = h;
            }
            continue;
        }
        for (k = 0; k < 2; k++) {
            const mesher__growth_node *child = g->nodes + 2 * node + k;
            d[k] = child->first <= region && region <= child->last
                       ? (double)child->least + slope * mesher__distance_to_box(at, &child->box)
                       : HUGE_VAL;
        }
        for (k = 0; k < 2; k++) { /* the better one last, to be searched first */
            const int child = (d[1] > d[0]) ^ k;
            stack[top] = 2 * node + (size_t)child;
            low[top++] = d[child];
        }
    }
    return most;
}

/* h(x) without the size function. Where sizes grow, this is what the corners of the background's
 * tetrahedron around x allow: too much, if they are far away. *home: in, a tetrahedron of the
 * background near x; out, the one that contains x. *found: whether there is one. */
static double mesher__field_at(const mesher__field *field, const double *x, delaunay_handle *home,
                               int *found)
{
    double w[4], size[4], h = 0, most = 1e300, weight = 0;
    const uint32_t *v;
    int i, bounded;
    *home = mesher__find_home(field, x, *home, w, found);
    v = field->tets[*home].v;
    bounded = mesher__corner_sizes(field, v, x, size, &most);
    for (i = 0; i < 4; i++) {
        double s = size[i], d;
        if (!(s > 0)) continue;
        h += w[i] * s;
        weight += w[i];
        if (bounded) continue;
        d = mesher__distance(field->vertices[v[i]].x, x);
        s = field->vertices[v[i]].size + field->slope * d;
        if (s < most) most = s;
    }
    if (!(weight > 0) || field->options->growth > 1 || most < h / weight) h = most;
    else h /= weight;
    return mesher__floored(field, h < field->cap ? h : field->cap);
}

/* The same, but where sizes grow all vertices of the region count. */
static double mesher__size_at(const mesher__field *field, const double *x, delaunay_handle *home,
                              int *found)
{
    const double h = mesher__field_at(field, x, home, found);
    if (!(field->options->growth > 1)) return h;
    return mesher__floored(
        field, mesher__grown_size(&field->growth, x, field->color[*home], field->slope, h));
}

/* ---- >>divide ----------------------------------------------------------------------------- */
/* Makes a surface of the same shape whose edges are no longer than wanted: the edge that is longest
 * relative to its wanted length is halved, with all triangles around it, until none is too long
 * [Rivara 1984]. After each halving, diagonals between triangles in a plane are flipped, so that
 * these stay a Delaunay triangulation [Lawson 1977] and needles do not multiply.
 *
 * Side i of triangle t, from its corner i to the next one, has the number 3*t + i. All sides at the
 * same edge form a ring. A line is stored as a triangle without a third corner; its only side is
 * side 0. */

/* An edge longer than its wanted length by this factor is halved. At this factor, its halves are
 * too short by the same factor. */
#  define MESHER__TOO_LONG 1.4142
/* Dividing needles narrower than this share of the wanted length only makes more needles. */
#  define MESHER__WIDE 0.4
/* Two triangles lie in one plane if the angle between them is at most MESHER__BEND radians, or if
 * it is at most MESHER__BEND_LOW and no corner is further from their plane than MESHER__PLANE_SHARE
 * of the surface's extent (for files in single precision, or with six digits). */
#  define MESHER__BEND        1e-4
#  define MESHER__BEND_LOW    0.1
#  define MESHER__PLANE_SHARE 1e-7
/* A triangle lower than this share of the largest coordinate could be turned over by rounding. */
#  define MESHER__LOW_SHARE 1e-12

typedef struct mesher__long_edge {
    double   excess; /* its length over the wanted one */
    uint32_t a, b, side;
} mesher__long_edge;

typedef struct mesher__divider {
    const mesher_domain *domain;
    mesher_fine_surface *out;
    delaunay_memory     *memory;
    uint32_t            *corners; /* 3 a triangle */
    uint32_t            *next;    /* 3 a triangle: the next side of the ring */
    uint32_t            *source;  /* 1 a triangle: the caller's, or num_triangles + line */
    size_t num, cap_corners, cap_next, cap_source;
    /* 1 a triangle of the caller's: the next one with the same vertices, NO_ID: none. Only the
     * first of them is divided. NULL: no triangle has copies */
    uint32_t            *copy;
    double              *wish;    /* wanted edge length at each vertex */
    size_t num_vertices, cap_xyz, cap_wish, cap_sizes;
    mesher__long_edge   *heap;
    size_t num_long, cap_long;
    uint32_t            *doubtful; /* a stack of sides whose edges may have to be flipped */
    size_t num_doubtful, cap_doubtful;
    double   largest, extent;      /* the largest coordinate; the largest extent along an axis */
    uint64_t flips_left;           /* a limit, as rounding could make flips cycle */
    int      only_flips;           /* no edge counts as too long, and there are no sizes */
    int      no_memory;
    int      budget;               /* 0, or the MESHER__BUDGET_.. that ended the division */
} mesher__divider;

static uint32_t mesher__side_turn(uint32_t side, uint32_t by)
{
    return side - side % 3 + (side % 3 + by) % 3;
}

static int mesher__is_line(const mesher__divider *d, uint32_t side)
{
    return d->corners[side - side % 3 + 2] == DELAUNAY_NO_ID;
}

/* Side y takes the place of side x in its ring. */
static void mesher__side_moves(mesher__divider *d, uint32_t x, uint32_t y)
{
    uint32_t before = x;
    while (d->next[before] != x) before = d->next[before];
    d->next[before] = y;
    d->next[y] = before == x ? y : d->next[x];
}

/* The midpoint x of edge ab. Returns the wanted length there: the mean of both ends, or what the
 * caller asks for if that is less. */
static double mesher__middle(const mesher__divider *d, uint32_t a, uint32_t b, double *x)
{
    const double *p = d->out->xyz + 3 * (size_t)a, *q = d->out->xyz + 3 * (size_t)b;
    double h = d->wish[a] / 2 + d->wish[b] / 2;
    double least = d->largest * 1e-12; /* beyond that, rounding would bend planes too much */
    uint32_t region = 0;
    int k;
    for (k = 0; k < 3; k++) x[k] = p[k] / 2 + q[k] / 2;
    mesher__wishes(&d->domain->options, 1, x, &region, &h);
    return h > least ? h : least;
}

static void mesher__heap_swap(mesher__long_edge *a, mesher__long_edge *b)
{
    mesher__long_edge kept = *a;
    *a = *b;
    *b = kept;
}

/* Is edge a to be halved before b? */
static int mesher__is_longer(const mesher__long_edge *a, const mesher__long_edge *b)
{
    if (a->excess != b->excess) return a->excess > b->excess;
    return a->a != b->a ? a->a < b->a : a->b < b->b;
}

static void mesher__heap_push(mesher__divider *d, const mesher__long_edge *e)
{
    size_t i = d->num_long;
    if (!mesher__room(d->memory, &d->heap, &d->cap_long, i, i + 1, sizeof *d->heap)) {
        d->no_memory = 1;
        return;
    }
    d->heap[d->num_long++] = *e;
    for (; i > 0 && mesher__is_longer(d->heap + i, d->heap + (i - 1) / 2); i = (i - 1) / 2)
        mesher__heap_swap(d->heap + i, d->heap + (i - 1) / 2);
}

static mesher__long_edge mesher__heap_pop(mesher__divider *d)
{
    mesher__long_edge top = d->heap[0];
    size_t i = 0, k;
    d->heap[0] = d->heap[--d->num_long];
    while ((k = 2 * i + 1) < d->num_long) {
        if (k + 1 < d->num_long && mesher__is_longer(d->heap + k + 1, d->heap + k)) k++;
        if (!mesher__is_longer(d->heap + k, d->heap + i)) break;
        mesher__heap_swap(d->heap + k, d->heap + i);
        i = k;
    }
    return top;
}

static double mesher__side_length(const mesher__divider *d, uint32_t side)
{
    return mesher__distance(d->out->xyz + 3 * (size_t)d->corners[side],
                            d->out->xyz + 3 * (size_t)d->corners[mesher__side_turn(side, 1)]);
}

/* The wanted length at the midpoint of a side. */
static double mesher__side_wish(const mesher__divider *d, uint32_t side)
{
    double x[3];
    return mesher__middle(d, d->corners[side], d->corners[mesher__side_turn(side, 1)], x);
}

/* Puts the edge of a side on the heap if it is too long. */
static void mesher__list_if_long(mesher__divider *d, uint32_t side)
{
    uint32_t p = d->corners[side], q = d->corners[mesher__side_turn(side, 1)];
    mesher__long_edge e;
    if (d->only_flips) return;
    e.a = p < q ? p : q;
    e.b = p < q ? q : p;
    e.side = side;
    e.excess = mesher__side_length(d, side) / mesher__side_wish(d, side);
    if (e.excess > MESHER__TOO_LONG) mesher__heap_push(d, &e);
}

/* -- flips */

static double mesher__dot_from(const double *o, const double *a, const double *b)
{
    return (a[0] - o[0]) * (b[0] - o[0]) + (a[1] - o[1]) * (b[1] - o[1]) +
           (a[2] - o[2]) * (b[2] - o[2]);
}

/* Do triangles abc and bae lie in one plane, without overlapping? */
static int mesher__is_plane(const mesher__divider *d, const double *a, const double *b,
                            const double *c, const double *e)
{
    double n[4][3], l[4], volume = 0, most = 0, along = 0, bend;
    int k;
    l[0] = mesher__normal(a, b, c, n[0]);
    l[1] = mesher__normal(b, a, e, n[1]);
    for (k = 0; k < 3; k++) along += n[0][k] * n[1][k];
    if (!(along > 0)) return 0; /* folded */
    l[2] = mesher__normal(c, a, e, n[2]);
    l[3] = mesher__normal(e, b, c, n[3]);
    for (k = 0; k < 3; k++) volume += (e[k] - a[k]) * n[0][k];
    for (k = 0; k < 4; k++) most = most > l[k] ? most : l[k];
    bend = fabs(volume) * mesher__distance(a, b) / (l[0] * l[1]);
    return bend <= MESHER__BEND || (bend <= MESHER__BEND_LOW &&
                                    fabs(volume) <= MESHER__PLANE_SHARE * d->extent * most);
}

/* Is the sum of the angles of triangles abc and bae at c and e more than 180 degrees? */
static int mesher__is_not_delaunay(const double *a, const double *b, const double *c,
                                   const double *e)
{
    double n[3], sin_c = mesher__normal(a, b, c, n), sin_e = mesher__normal(b, a, e, n);
    double cos_c = mesher__dot_from(c, a, b), cos_e = mesher__dot_from(e, a, b);
    return cos_c * sin_e + cos_e * sin_c < -1e-9 * sqrt(cos_c * cos_c + sin_c * sin_c) *
                                               sqrt(cos_e * cos_e + sin_e * sin_e);
}

/* Would triangles cae and ebc face the same way as abc and bae do? */
static int mesher__keeps_sides(const double *a, const double *b, const double *c, const double *e)
{
    double n[4][3], first = 0, second = 0;
    int k;
    mesher__normal(a, b, c, n[0]);
    mesher__normal(b, a, e, n[1]);
    mesher__normal(c, a, e, n[2]);
    mesher__normal(e, b, c, n[3]);
    for (k = 0; k < 3; k++) {
        first += (n[0][k] + n[1][k]) * n[2][k];
        second += (n[0][k] + n[1][k]) * n[3][k];
    }
    return first > 0 && second > 0;
}

static int32_t mesher__tag_of(const mesher__divider *d, uint32_t side)
{
    const int32_t *tags = d->domain->surface.triangle_tags;
    return tags ? tags[d->source[side / 3]] : 1;
}

/* May the triangles of two sides exchange area by a flip? They must have the same tag. If they are
 * parts of different triangles of the caller's, neither of these may have copies, since the parts
 * of a triangle are copied with it. */
static int mesher__are_alike(const mesher__divider *d, uint32_t s, uint32_t r)
{
    const uint32_t a = d->source[s / 3], b = d->source[r / 3];
    return a == b || (mesher__tag_of(d, s) == mesher__tag_of(d, r) &&
                      (!d->copy || (d->copy[a] == DELAUNAY_NO_ID && d->copy[b] == DELAUNAY_NO_ID)));
}

/* Does a side lie between exactly two triangles, in one plane and of the same tag and orientation?
 * x: both ends of the side, and the third corners of its own triangle and of the other one. */
static int mesher__joins_plane(const mesher__divider *d, uint32_t s, const double **x)
{
    uint32_t r = d->next[s], v[4];
    int k;
    if (r == s || d->next[r] != s || mesher__is_line(d, s) || mesher__is_line(d, r) ||
        !mesher__are_alike(d, s, r))
        return 0;
    v[0] = d->corners[s];
    v[1] = d->corners[mesher__side_turn(s, 1)];
    v[2] = d->corners[mesher__side_turn(s, 2)];
    v[3] = d->corners[mesher__side_turn(r, 2)];
    for (k = 0; k < 4; k++) x[k] = d->out->xyz + 3 * (size_t)v[k];
    return d->corners[r] == v[1] && v[2] != v[3] && mesher__is_plane(d, x[0], x[1], x[2], x[3]);
}

/* Is there an edge from the third corner c of side s's triangle to vertex e? Looks at the triangles
 * around c, from this one to both sides as far as two triangles share an edge; of c with very many
 * of them the answer is always yes. */
static int mesher__has_edge_to(const mesher__divider *d, uint32_t s, uint32_t e)
{
    enum { MOST = 1000 };
    const uint32_t c = d->corners[mesher__side_turn(s, 2)];
    int k, step;
    for (k = 2; k > 0; k--) {
        const uint32_t first = mesher__side_turn(s, (uint32_t)k);
        uint32_t at = first, r;
        for (step = 0; (r = d->next[at]) != at && d->next[r] == at; step++) {
            if (step == MOST || d->corners[mesher__side_turn(r, 2)] == e) return 1;
            at = mesher__side_turn(r, d->corners[r] == c ? 2 : 1);
            if (at == first) return 0;
        }
    }
    return 0;
}

/* A surface that is bent a little may have the edge already that the flip would make, behind the
 * two triangles: it would fold them onto each other. */
static int mesher__is_to_flip(const mesher__divider *d, uint32_t s)
{
    const double *x[4];
    return mesher__joins_plane(d, s, x) && mesher__is_not_delaunay(x[0], x[1], x[2], x[3]) &&
           mesher__keeps_sides(x[0], x[1], x[2], x[3]) &&
           (delaunay_orient3d(x[0], x[1], x[2], x[3]) == 0 ||
            !mesher__has_edge_to(d, s, d->corners[mesher__side_turn(d->next[s], 2)]));
}

static void mesher__doubt(mesher__divider *d, uint32_t side)
{
    if (mesher__room(d->memory, &d->doubtful, &d->cap_doubtful, d->num_doubtful,
                     d->num_doubtful + 1, sizeof *d->doubtful))
        d->doubtful[d->num_doubtful++] = side;
    else d->no_memory = 1;
}

/* Triangles abc and bae, s and r their sides ab and ba, become cae and ebc. */
static void mesher__flip_side(mesher__divider *d, uint32_t s)
{
    uint32_t r = d->next[s], s1 = mesher__side_turn(s, 1), s2 = mesher__side_turn(s, 2);
    uint32_t r1 = mesher__side_turn(r, 1), r2 = mesher__side_turn(r, 2);
    uint32_t a = d->corners[s], b = d->corners[r], c = d->corners[s2], e = d->corners[r2];
    mesher__side_moves(d, s2, s);
    mesher__side_moves(d, r2, r);
    mesher__side_moves(d, s1, s2); /* out of the way */
    mesher__side_moves(d, r1, s1);
    mesher__side_moves(d, s2, r1);
    d->next[s2] = r2;
    d->next[r2] = s2;
    d->corners[s] = c;
    d->corners[s1] = a;
    d->corners[s2] = e;
    d->corners[r] = e;
    d->corners[r1] = b;
    d->corners[r2] = c;
    mesher__list_if_long(d, s);
    mesher__list_if_long(d, s1);
    mesher__list_if_long(d, s2);
    mesher__list_if_long(d, r);
    mesher__list_if_long(d, r1);
    mesher__doubt(d, s);
    mesher__doubt(d, s1);
    mesher__doubt(d, r);
    mesher__doubt(d, r1);
}

static void mesher__flip_doubtful(mesher__divider *d)
{
    while (d->num_doubtful > 0 && !d->no_memory) {
        uint32_t s = d->doubtful[--d->num_doubtful];
        if (!mesher__is_to_flip(d, s)) continue;
        if (d->flips_left == 0) return;
        d->flips_left--;
        d->out->num_flips++;
        mesher__flip_side(d, s);
    }
}

/* -- splits */

/* Makes room for one more vertex and the given number of triangles. */
static int mesher__divider_room(mesher__divider *d, size_t triangles)
{
    mesher_fine_surface *out = d->out;
    size_t n = d->num_vertices, t = d->num, need = d->num + triangles;
    return mesher__room(d->memory, &out->xyz, &d->cap_xyz, n, n + 1, 3 * sizeof *out->xyz) &&
           mesher__room(d->memory, &d->wish, &d->cap_wish, n, n + 1, sizeof *d->wish) &&
           (!out->vertex_sizes || mesher__room(d->memory, &out->vertex_sizes, &d->cap_sizes, n,
                                               n + 1, sizeof *out->vertex_sizes)) &&
           mesher__room(d->memory, &d->corners, &d->cap_corners, t, need, 3 * sizeof *d->corners) &&
           mesher__room(d->memory, &d->next, &d->cap_next, t, need, 3 * sizeof *d->next) &&
           mesher__room(d->memory, &d->source, &d->cap_source, t, need, sizeof *d->source);
}

/* Does the plane on this side of an edge reach as far as width? Where it consists of needles, it is
 * followed from one needle to the next. */
static int mesher__is_wide(const mesher__divider *d, uint32_t side, double width)
{
    const double *xyz = d->out->xyz, *a = xyz + 3 * (size_t)d->corners[side], *x[4];
    const double *b = xyz + 3 * (size_t)d->corners[mesher__side_turn(side, 1)];
    double n[3], least = width * mesher__distance(a, b);
    uint32_t s = side, s1, s2;
    int step;
    for (step = 0; step < 100; step++) {
        s1 = mesher__side_turn(s, 1);
        s2 = mesher__side_turn(s, 2);
        if (mesher__normal(a, b, xyz + 3 * (size_t)d->corners[s2], n) >= least) return 1;
        s = mesher__side_length(d, s1) > mesher__side_length(d, s2) ? s1 : s2;
        if (!mesher__joins_plane(d, s, x)) return 0;
        s = d->next[s];
    }
    return 1;
}

/* Is it worthwhile to halve the edge of a side, which is too long? Not if all triangles around it
 * are needles. */
static int mesher__is_worth_it(const mesher__divider *d, uint32_t side)
{
    double width = MESHER__WIDE * mesher__side_wish(d, side);
    uint32_t r = side;
    int lines = 0, triangles = 0;
    do {
        if (mesher__is_line(d, r)) lines++;
        else if (mesher__is_wide(d, r, width)) return 1;
        else triangles++;
        r = d->next[r];
    } while (r != side);
    return lines > 0 && triangles == 0;
}

/* The number of sides in the ring of s, or 0 if one of its triangles is so low that rounding could
 * turn it over. */
static size_t mesher__ring_to_split(const mesher__divider *d, uint32_t s)
{
    const double *xyz = d->out->xyz, *a = xyz + 3 * (size_t)d->corners[s];
    const double *b = xyz + 3 * (size_t)d->corners[mesher__side_turn(s, 1)];
    double n[3], least = MESHER__LOW_SHARE * d->largest * mesher__distance(a, b);
    uint32_t r = s;
    size_t count = 0;
    do {
        uint32_t c = d->corners[mesher__side_turn(r, 2)];
        if (!mesher__is_line(d, r) && !(mesher__normal(a, b, xyz + 3 * (size_t)c, n) > least))
            return 0;
        count++;
        r = d->next[r];
    } while (r != s);
    return count;
}

/* Adds a vertex at the midpoint of a side. */
static uint32_t mesher__add_middle(mesher__divider *d, uint32_t s)
{
    uint32_t a = d->corners[s], b = d->corners[mesher__side_turn(s, 1)];
    uint32_t m = (uint32_t)d->num_vertices++;
    double *own = d->out->vertex_sizes;
    d->wish[m] = mesher__middle(d, a, b, d->out->xyz + 3 * (size_t)m);
    if (own) own[m] = own[a] > 0 && own[b] > 0 ? own[a] / 2 + own[b] / 2 : 0;
    return m;
}

/* Halves the triangle (or line) of side s, which goes from p to q, at m. It keeps the half at p; a
 * new one gets the other half. Returns the side of the new one that is its half of s. Neither half
 * of s is in the right ring yet. */
static uint32_t mesher__halve(mesher__divider *d, uint32_t s, uint32_t m)
{
    uint32_t t = (uint32_t)d->num++, h = 3 * t + s % 3, k;
    uint32_t s1 = mesher__side_turn(s, 1), h1 = mesher__side_turn(h, 1);
    uint32_t h2 = mesher__side_turn(h, 2);
    d->source[t] = d->source[s / 3];
    for (k = 0; k < 3; k++) {
        d->corners[3 * t + k] = d->corners[s - s % 3 + k];
        d->next[3 * t + k] = 3 * t + k;
    }
    d->corners[h] = m;
    if (!mesher__is_line(d, h)) {
        mesher__side_moves(d, s1, h1);
        d->next[s1] = h2;
        d->next[h2] = s1;
    }
    d->corners[s1] = m;
    return h;
}

/* Halves the edge of a side, and all triangles and lines at it. */
static void mesher__split_side(mesher__divider *d, uint32_t s)
{
    uint32_t m = mesher__add_middle(d, s), a = d->corners[s], r = s, first[2], last[2], i;
    first[0] = first[1] = last[0] = last[1] = DELAUNAY_NO_ID;
    do {
        uint32_t after = d->next[r], half[2];
        int turned = d->corners[r] != a;
        half[turned] = r;
        half[!turned] = mesher__halve(d, r, m);
        for (i = 0; i < 2; i++) { /* the rings of both halves of the edge */
            if (first[i] == DELAUNAY_NO_ID) first[i] = half[i];
            else d->next[last[i]] = half[i];
            last[i] = half[i];
            d->next[half[i]] = first[i];
        }
        if (!mesher__is_line(d, r)) {
            uint32_t h = half[!turned];
            mesher__list_if_long(d, mesher__side_turn(r, 1));
            mesher__list_if_long(d, mesher__side_turn(r, 2)); /* may not have been worthwhile */
            mesher__list_if_long(d, mesher__side_turn(h, 1));
            mesher__doubt(d, mesher__side_turn(r, 2));
            mesher__doubt(d, mesher__side_turn(h, 1));
        }
        r = after;
    } while (r != s);
    for (i = 0; i < 2; i++) mesher__list_if_long(d, first[i]);
}

/* Called before each edge: is the division to end, by max_seconds or the host's progress? */
static mesher_result mesher__division_ends(mesher__divider *d, uint64_t round, double start)
{
    const mesher_options *o = &d->domain->options;
    if (round % 1024) return MESHER_OK;
    if (mesher__progress(o, "surface", -1)) return MESHER_CANCELLED;
    if (!(o->max_seconds > 0 && delaunay_seconds(&o->host) - start > o->max_seconds))
        return MESHER_OK;
    d->budget = MESHER__BUDGET_SECONDS;
    return MESHER_STOPPED_BY_BUDGET;
}

/* A wall: an edge that ends a plane, is an edge of a triangle at the given side, subtends more than
 * 120 degrees as seen from the midpoint of that side, and is longer than half of what is wanted
 * there. Returns the longest wall, or NO_ID. Were it not halved first, the edges that begin at it
 * would be halved nearer and nearer to it, which makes needles. */
static uint32_t mesher__wall_beside(const mesher__divider *d, uint32_t side)
{
    const double *xyz = d->out->xyz, *x[4];
    double m[3], longest =
        mesher__middle(d, d->corners[side], d->corners[mesher__side_turn(side, 1)], m) / 2;
    uint32_t r = side, wall = DELAUNAY_NO_ID, i;
    do {
        for (i = 1; i < 3 && !mesher__is_line(d, r); i++) {
            uint32_t u = mesher__side_turn(r, i);
            const double *a = xyz + 3 * (size_t)d->corners[u];
            const double *b = xyz + 3 * (size_t)d->corners[mesher__side_turn(u, 1)];
            double cosine = mesher__dot_from(m, a, b), length = mesher__side_length(d, u);
            if (length > longest && cosine < 0 &&
                4 * cosine * cosine > mesher__dot_from(m, a, a) * mesher__dot_from(m, b, b) &&
                !mesher__joins_plane(d, u, x)) {
                longest = length;
                wall = u;
            }
        }
        r = d->next[r];
    } while (r != side);
    return wall;
}

/* Halves the edge of a side, which is too long, if that is worthwhile. If there is a wall beside
 * it, halves that instead; the side is then put on the heap again. */
static mesher_result mesher__divide_at(mesher__divider *d, uint32_t side)
{
    const mesher_options *o = &d->domain->options;
    const size_t limit = o->host.memory_limit_bytes; /* to mesh the surface takes more */
    size_t count = mesher__ring_to_split(d, side), walls;
    uint32_t wall;
    if (count == 0 || !mesher__is_worth_it(d, side)) return MESHER_OK;
    wall = mesher__wall_beside(d, side);
    walls = wall != DELAUNAY_NO_ID ? mesher__ring_to_split(d, wall) : 0;
    if (walls) {
        side = wall;
        count = walls;
    }
    if (o->max_vertices && d->num_vertices >= o->max_vertices / 2)
        d->budget = MESHER__BUDGET_VERTICES;
    if (o->max_tets && d->num + count > o->max_tets / 2) d->budget = MESHER__BUDGET_TETS;
    if (limit && d->memory->bytes > limit / 4) d->budget = MESHER__BUDGET_MEMORY;
    if (d->budget) return MESHER_STOPPED_BY_BUDGET;
    if (d->num_vertices >= UINT32_MAX - 32 || d->num + count >= UINT32_MAX / 3 - 16)
        return MESHER_ERROR_TOO_LARGE;
    if (!mesher__divider_room(d, count)) return MESHER_ERROR_OUT_OF_MEMORY;
    mesher__split_side(d, side);
    d->flips_left += 64;
    mesher__flip_doubtful(d);
    return d->no_memory ? MESHER_ERROR_OUT_OF_MEMORY : MESHER_OK;
}

static mesher_result mesher__divide(mesher__divider *d)
{
    double start = delaunay_seconds(&d->domain->options.host);
    mesher_result result = MESHER_OK;
    uint64_t round;
    for (round = 0; d->num_long > 0 && result == MESHER_OK; round++) {
        mesher__long_edge e = mesher__heap_pop(d);
        uint32_t p = d->corners[e.side], q = d->corners[mesher__side_turn(e.side, 1)];
        result = mesher__division_ends(d, round, start);
        if (result == MESHER_OK && ((p == e.a && q == e.b) || (p == e.b && q == e.a)))
            result = mesher__divide_at(d, e.side); /* else the side is another edge's by now */
    }
    return result;
}

/* -- in and out */

/* Links the sides at the same edge into rings. */
static mesher_result mesher__make_rings(mesher__divider *d, mesher_domain *domain)
{
    size_t n = 0, i, k;
    mesher_result result;
    hxtsort_pair *sides =
        (hxtsort_pair *)delaunay_alloc(d->memory, 3 * d->num + 1, sizeof *sides);
    if (!sides) return MESHER_ERROR_OUT_OF_MEMORY;
    for (i = 0; i < 3 * d->num; i++) {
        uint32_t s = (uint32_t)i, a = d->corners[s], b = d->corners[mesher__side_turn(s, 1)];
        d->next[s] = s;
        if (mesher__is_line(d, s) && s % 3) continue;
        sides[n].key = mesher__pair(a, b);
        sides[n++].value = s;
    }
    result = mesher__sort(domain, sides, n);
    for (i = 0; i < n && result == MESHER_OK; i = k)
        for (k = i + 1; k < n && sides[k].key == sides[i].key; k++) {
            d->next[sides[k].value] = d->next[sides[k - 1].value];
            d->next[sides[k - 1].value] = (uint32_t)sides[k].value;
        }
    delaunay_release(d->memory, sides);
    return result;
}

/* Appends the caller's triangle or line of this number, unless it has a corner twice. */
static void mesher__take_element(mesher__divider *d, const uint32_t *v, uint32_t third,
                                 uint32_t number)
{
    uint32_t *c = d->corners + 3 * d->num;
    c[0] = d->domain->survivor[v[0]];
    c[1] = d->domain->survivor[v[1]];
    c[2] = third;
    if (c[0] == c[1] || c[0] == c[2] || c[1] == c[2]) return;
    d->source[d->num++] = number;
}

/* The first triangle with the vertices of triangle i. */
static uint32_t mesher__first_copy(const mesher_domain *domain, uint32_t i)
{
    uint32_t v[3], f;
    mesher__sorted_triangle(domain, i, v);
    f = mesher__facet_find(domain, v);
    return f == DELAUNAY_NO_ID ? i : domain->facet_source[f];
}

/* Chains the triangles that have the same vertices. */
static mesher_result mesher__find_copies(mesher__divider *d)
{
    uint32_t n = (uint32_t)d->domain->surface.num_triangles, i;
    if (d->domain->num_facets == n) return MESHER_OK;
    d->copy = (uint32_t *)delaunay_alloc(d->memory, n, sizeof *d->copy);
    if (!d->copy) return MESHER_ERROR_OUT_OF_MEMORY;
    for (i = 0; i < n; i++) d->copy[i] = DELAUNAY_NO_ID;
    for (i = n; i-- > 0;) {
        const uint32_t first = mesher__first_copy(d->domain, i);
        if (first == i) continue;
        d->copy[i] = d->copy[first];
        d->copy[first] = i;
    }
    return MESHER_OK;
}

static mesher_result mesher__divider_init(mesher__divider *d, mesher_domain *domain,
                                          mesher_fine_surface *out)
{
    const mesher_surface *s = &domain->surface;
    const double *own = domain->options.vertex_sizes;
    double lo[3];
    size_t total = s->num_triangles + s->num_edges, i;
    d->domain = domain;
    d->out = out;
    d->memory = &out->memory;
    if (own && !mesher__grow(d->memory, &out->vertex_sizes, &d->cap_sizes, 0, s->num_vertices + 1,
                             sizeof *own))
        return MESHER_ERROR_OUT_OF_MEMORY;
    d->num_vertices = s->num_vertices - 1; /* room for the last of them, and the triangles */
    if (!mesher__divider_room(d, total)) return MESHER_ERROR_OUT_OF_MEMORY;
    d->num_vertices++;
    memcpy(out->xyz, s->xyz, 3 * d->num_vertices * sizeof *out->xyz);
    if (own) memcpy(out->vertex_sizes, own, d->num_vertices * sizeof *own);
    d->extent = mesher__extent(&domain->surface, lo, &d->largest);
    for (i = 0; i < d->num_vertices; i++) {
        double h = d->only_flips ? 0 : domain->size[domain->mesh.vertex_of[i]];
        d->wish[i] = h > 0 ? h : DBL_MAX; /* a vertex of no region, or a duplicate */
    }
    if (mesher__find_copies(d) != MESHER_OK) return MESHER_ERROR_OUT_OF_MEMORY;
    for (i = 0; i < s->num_triangles; i++)
        if (!d->copy || mesher__first_copy(domain, (uint32_t)i) == i)
            mesher__take_element(d, s->triangles + 3 * i,
                                 domain->survivor[s->triangles[3 * i + 2]], (uint32_t)i);
    for (i = 0; i < s->num_edges; i++)
        mesher__take_element(d, s->edges + 2 * i, DELAUNAY_NO_ID,
                             (uint32_t)(s->num_triangles + i));
    d->flips_left = 64 * (uint64_t)d->num + 1024;
    return mesher__make_rings(d, domain);
}

static void mesher__divider_free(mesher__divider *d)
{
    delaunay_release(d->memory, d->corners);
    delaunay_release(d->memory, d->next);
    delaunay_release(d->memory, d->source);
    delaunay_release(d->memory, d->copy);
    delaunay_release(d->memory, d->wish);
    delaunay_release(d->memory, d->heap);
    delaunay_release(d->memory, d->doubtful);
}

/* Writes triangle i as a part of the caller's triangle `source`, which is its own or a copy of it.
 */
static void mesher__triangle_out(const mesher__divider *d, size_t i, uint32_t source, size_t at)
{
    const mesher_surface *given = &d->domain->surface;
    mesher_fine_surface *out = d->out;
    const uint32_t *c = d->corners + 3 * i;
    uint32_t *t = out->triangles + 3 * at, v[3];
    int turn = mesher__sorted_triangle(d->domain, d->source[i], v) !=
               mesher__sorted_triangle(d->domain, source, v);
    t[0] = c[0];
    t[1] = c[turn ? 2 : 1];
    t[2] = c[turn ? 1 : 2];
    out->triangle_tags[at] = given->triangle_tags ? given->triangle_tags[source] : 1;
    out->triangle_source[at] = source;
}

/* The caller's next triangle with the same vertices, or NO_ID. */
static uint32_t mesher__next_copy(const mesher__divider *d, uint32_t source)
{
    return d->copy ? d->copy[source] : DELAUNAY_NO_ID;
}

/* The number of triangles and lines to be written, with copies. */
static void mesher__count_out(const mesher__divider *d, size_t *triangles, size_t *lines)
{
    size_t i;
    uint32_t s;
    *triangles = *lines = 0;
    for (i = 0; i < d->num; i++)
        if (d->corners[3 * i + 2] == DELAUNAY_NO_ID) ++*lines;
        else
            for (s = d->source[i]; s != DELAUNAY_NO_ID; s = mesher__next_copy(d, s))
                ++*triangles;
}

/* Writes triangles and lines into the arrays that the caller gets. */
static mesher_result mesher__division_out(mesher__divider *d)
{
    const mesher_surface *given = &d->domain->surface;
    mesher_fine_surface *out = d->out;
    size_t i, triangles, lines, n = 0, m = 0;
    mesher__count_out(d, &triangles, &lines);
    if (triangles >= UINT32_MAX / 3 - 16) return MESHER_ERROR_TOO_LARGE;
    out->triangles = (uint32_t *)delaunay_alloc(d->memory, triangles + 1, 3 * sizeof(uint32_t));
    out->triangle_tags = (int32_t *)delaunay_alloc(d->memory, triangles + 1, sizeof(int32_t));
    out->triangle_source = (uint32_t *)delaunay_alloc(d->memory, triangles + 1, sizeof(uint32_t));
    out->edges = (uint32_t *)delaunay_alloc(d->memory, lines + 1, 2 * sizeof(uint32_t));
    out->edge_tags = (int32_t *)delaunay_alloc(d->memory, lines + 1, sizeof(int32_t));
    out->edge_source = (uint32_t *)delaunay_alloc(d->memory, lines + 1, sizeof(uint32_t));
    if (!out->triangles || !out->triangle_tags || !out->triangle_source || !out->edges ||
        !out->edge_tags || !out->edge_source)
        return MESHER_ERROR_OUT_OF_MEMORY;
    if (given->left_out) {
        out->left_out = (uint8_t *)delaunay_alloc(d->memory, d->num_vertices, 1);
        if (!out->left_out) return MESHER_ERROR_OUT_OF_MEMORY;
        memset(out->left_out, 0, d->num_vertices);
        memcpy(out->left_out, given->left_out, given->num_vertices);
    }
    for (i = 0; i < d->num; i++) {
        const uint32_t *c = d->corners + 3 * i;
        if (c[2] == DELAUNAY_NO_ID) {
            uint32_t line = d->source[i] - (uint32_t)given->num_triangles;
            memcpy(out->edges + 2 * m, c, 2 * sizeof *c);
            out->edge_tags[m] = given->edge_tags ? given->edge_tags[line] : 1;
            out->edge_source[m++] = line;
        } else {
            uint32_t s = d->source[i];
            for (; s != DELAUNAY_NO_ID; s = mesher__next_copy(d, s))
                mesher__triangle_out(d, i, s, n++);
        }
    }
    out->surface = *given;
    out->surface.xyz = out->xyz;
    out->surface.num_vertices = d->num_vertices;
    out->surface.left_out = out->left_out;
    out->surface.triangles = out->triangles;
    out->surface.triangle_tags = out->triangle_tags;
    out->surface.num_triangles = n;
    out->surface.edges = out->edges;
    out->surface.edge_tags = out->edge_tags;
    out->surface.num_edges = m;
    return MESHER_OK;
}

/* Divides the surface of a domain whose sizes are known. */
static mesher_result mesher__divide_surface(mesher_fine_surface *out, mesher_domain *domain,
                                            mesher__divider *d)
{
    mesher_result result = mesher__divider_init(d, domain, out), written;
    size_t i;
    for (i = 0; i < 3 * d->num && result == MESHER_OK; i++) {
        mesher__doubt(d, (uint32_t)i);
        mesher__flip_doubtful(d);
    }
    for (i = 0; i < 3 * d->num && result == MESHER_OK; i++)
        if (d->next[i] >= i && (i % 3 == 0 || !mesher__is_line(d, (uint32_t)i)))
            mesher__list_if_long(d, (uint32_t)i);
    if (d->no_memory) result = MESHER_ERROR_OUT_OF_MEMORY;
    if (result == MESHER_OK) result = mesher__divide(d);
    if (result < 0) return result;
    written = mesher__division_out(d);
    return written < 0 ? written : result;
}

MESHER_API void mesher_fine_surface_free(mesher_fine_surface *fine)
{
    delaunay_memory *m;
    if (!fine) return;
    m = &fine->memory;
    if (m->allocator.release) {
        delaunay_release(m, fine->xyz);
        delaunay_release(m, fine->vertex_sizes);
        delaunay_release(m, fine->triangles);
        delaunay_release(m, fine->triangle_tags);
        delaunay_release(m, fine->triangle_source);
        delaunay_release(m, fine->edges);
        delaunay_release(m, fine->edge_tags);
        delaunay_release(m, fine->edge_source);
        delaunay_release(m, fine->left_out);
    }
    memset(fine, 0, sizeof *fine);
}

/* ---- >>refine ----------------------------------------------------------------------------- */
/* Sweeps: every tetrahedron that is new and too large proposes a point; proposals too near each
 * other or an existing vertex are dropped; the rest is inserted by the algorithm of Bowyer and
 * Watson, with a cavity that stops at constrained facets and is cut until the point sees all of its
 * boundary [Marot 2020, 5].
 *
 * Why a star-shaped cavity is enough: its tetrahedra do not overlap, and the cones from p over
 * its boundary have the same boundary; so if each cone is positive they tile the same set. Then
 * the boundary is a sphere, and what may be lost is only a vertex or a constrained edge that is
 * not on it: both are tested. */

enum {
    /* a stage bit: this tetrahedron has proposed its point, or is small enough */
    MESHER__SEEN = 0x400,
    /* two stage bits count, up to 3, how often its point lost against another one; the next time
     * sets MESHER__SEEN */
    MESHER__LOST = 0x800,
    MESHER__LOST_MASK = 0x1800,
    MESHER__WALK_STEPS = 2000, /* a longer walk is taken for a cycle; the point is given up */
    MESHER__ROW = 6,
    MESHER__LOCAL = 1 << MESHER__ROW /* most vertices of a cavity whose edges are in a matrix */
};

/* Least distance between two vertices, relative to the mean of their sizes. */
#define MESHER__SPACING 0.8
/* If the size at one corner of a tetrahedron exceeds the mean of the others by this factor, a point
 * may be wanted even though the circumcentre is too near to that corner. */
#define MESHER__UNEVEN 1.25
/* Least height of a point over a constrained facet, relative to the mean size of the facet's
 * corners. */
#  define MESHER__LOW 0.35

typedef struct mesher__proposal {
    double          x[3], h;
    delaunay_handle source; /* the tetrahedron that proposed it; 0: none */
    uint32_t        stamp;  /* a hash of source's vertices: tells if its slot was reused since */
    delaunay_handle tet;    /* one that contained it when it was proposed */
    delaunay_handle home;   /* the tetrahedron of the background that contains it */
    uint32_t        region;
    uint32_t        vertex; /* its vertex number, which is given beforehand where threads insert */
    delaunay_handle start;  /* a slot of its section, near it if it is in use, or 0 */
    int32_t         state;  /* what became of it: MESHER__DONE .. */
} mesher__proposal;

/* A point in a grid. It takes half a cache line, since what a search costs is reading points. */
typedef struct mesher__spot {
    double   x[3];
    float    h;    /* its size, in units of the cell width of its level */
    uint32_t next; /* 1 + index of the next one in its cell, or 0 */
} mesher__spot;

/* A hash table of cubic cells that list points. The cells of level l are 2^l wide. A point is
 * listed in the levels of all sizes whose search has to find it. */
typedef struct mesher__grid {
    uint64_t *used;   /* for each block of 4 x 4 x 4 cells: a bit for each cell with points */
    uint32_t *cells;  /* 1 + index of the first point, where used */
    mesher__spot *spots;
    size_t    num_spots, cap_used, cap_cells, cap_spots, mask; /* mask: of blocks */
    int       low, high; /* levels in use */
    double    origin[3]; /* less than the coordinates of all points */
} mesher__grid;

/* The points that one thread gathers from a range of slots. */
enum { MESHER__SLOTS = 1 << 13 };
typedef struct mesher__harvest {
    mesher__proposal *points;
    size_t            num_points, cap_points;
    mesher__grid      grid;
} mesher__harvest;

/* A facet of a cavity's boundary, with its vertices in outward order. */
typedef struct mesher__facet {
    uint32_t        v[3];
    uint32_t        local[3]; /* their local numbers */
    delaunay_handle outer;  /* the facet as seen from outside the cavity, or 0 */
    uint16_t        flags;  /* of the new tetrahedron (p, v[0], v[1], v[2]) */
} mesher__facet;

/* Scratch of one thread for insertions. */
typedef struct mesher__cavity {
    delaunay_memory *memory;
    delaunay_handle *tets;      /* in the cavity, the one with the point first */
    uint32_t         num_tets;
    size_t           cap_tets;
    delaunay_handle *queue;     /* facets by which the search reached the others, in it or not */
    delaunay_handle *border;    /* facets of the boundary, as those of tetrahedra in the cavity */
    delaunay_handle *slots;     /* of the new tetrahedra */
    uint32_t         num_queue, num_border;
    size_t           cap_search; /* capacity of each of the three lists */
    int              whole;     /* nothing has been cut off since the search */
    mesher__facet   *facets;
    uint32_t         num_facets;
    size_t           cap_facets;
    uint32_t        *vertices;  /* of the boundary */
    uint32_t         num_vertices;
    size_t           cap_vertices;
    uint32_t         num_locals; /* the local numbers of the vertices are less than this */
    uint64_t        *hash_key;  /* directed edges of a large boundary; values as in matrix */
    uint32_t        *hash_value;
    uint32_t         cap_hash, hash_mask;
    int              simd;      /* the processor has AVX2 */
    int shared; /* other threads insert too: no allocation, and only in its own section */
    uint32_t         section;   /* that section: vertices[].key of its vertices */
    delaunay_handle  nearby;    /* a tetrahedron near the point tried last, or 0 */
    uint32_t         most;      /* a cavity of more tetrahedra is given up */
    struct mesher__section *pool; /* where new tetrahedra come from, if shared */
    int              row;       /* a row of the matrix has 2^row entries */
    delaunay_plain plain;
    uint32_t matrix[MESHER__LOCAL * MESHER__LOCAL]; /* directed edges of a small boundary: 4*facet
                                  * + the corner of its new tetrahedron that is opposite the edge */
} mesher__cavity;

/* A section of the Hilbert curve; one thread inserts its points. */
typedef struct mesher__section {
    size_t           first, end;    /* points, in r->order */
    delaunay_handle *slots;         /* a stack of free ones */
    uint32_t         num_slots, cap_slots;
    delaunay_handle  fresh, fresh_end; /* free ones that have never been used */
    delaunay_handle  start;         /* a tetrahedron that it has at first, or 0 */
    uint64_t         inserted, born, dead; /* vertices; tetrahedra made and removed */
    uint64_t         lost;          /* tetrahedra looked at for points that were given up */
} mesher__section;

enum { MESHER__SECTIONS = 256 };

/* Nodes of a lattice that have been tried, in a cube of 4 x 4 x 4. */
typedef struct mesher__seen {
    uint64_t cube, bits; /* no bits: a free slot */
} mesher__seen;

typedef struct mesher__refiner {
    mesher_domain   *domain;
    delaunay_mesh   *mesh;
    delaunay_memory *memory;
    const mesher_options *options;
    mesher__field    field;
    delaunay_handle *home;       /* of each vertex: a tetrahedron of the background */
    size_t           cap_home;
    mesher__proposal   *points;     /* of this sweep */
    size_t           num_points, cap_points;
    hxtsort_pair    *order;      /* (key on the curve, index) of the points */
    uint64_t        *keys;
    size_t           cap_order, cap_keys;
    hilbert_box      box;
    mesher__grid     grid;
    uint64_t        *nodes;      /* the lattice node of each point */
    struct mesher__seen *seen;   /* a hash table of all nodes that have been tried */
    struct mesher__candidate *front; /* the candidates of a batch */
    struct mesher__lattice_start *starts;
    uint64_t         num_lattices;
    size_t           cap_nodes, num_seen, cap_seen, cap_front, num_starts, cap_starts;
    size_t           num_unnoticed; /* starts whose sizes the vertices around know nothing of */
    mesher__cavity   cavity;     /* for insertion by one thread alone */
    mesher__section  sections[MESHER__SECTIONS];
    delaunay_handle *slots;      /* the lists of all sections */
    size_t           cap_slots;
    mesher__cavity  *cavities;   /* for insertion by sections: one for each thread */
    mesher__harvest *harvests;
    delaunay_crew    crew;       /* for the short loops of the sweeps */
    int              num_harvests;
    int              num_cavities;
    int cancelled; /* 1: by the host, 2: out of time; set by the calling thread, read by all */
    int budget;    /* the MESHER__BUDGET_.. that was exhausted last */
    uint64_t         inserted, num_tets, ignored; /* ignored: answers that were no size */
    uint64_t         lost;       /* tetrahedra looked at for points that were given up */
    double           most_points; /* of the lattices, for the memory limit */
    uint64_t         max_vertices; /* of the mesh, by the budget of the output; 0: none */
    double           start;
} mesher__refiner;

/* Is the distance of a and b below MESHER__SPACING times the mean of their sizes, whose sum is
 * given? */
static inline int mesher__too_near(const double *a, const double *b, double sum)
{
    double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
    return x * x + y * y + z * z < MESHER__SPACING * MESHER__SPACING / 4 * sum * sum;
}

/* -- points by cells */

/* 2 to the power of e, in the range of sizes. */
static inline double mesher__power(int e)
{
    uint64_t bits = (uint64_t)(e + 1023) << 52;
    double x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

/* The level of a point of size h: its cells are one to two times as wide as the distance that the
 * point keeps from others of its size. */
static inline int mesher__level(double h)
{
    double reach = MESHER__SPACING * h;
    uint64_t bits;
    memcpy(&bits, &reach, sizeof bits);
    return (int)(bits >> 52) - 1022;
}

/* The index of the block of 4 x 4 x 4 cells with these coordinates, by hashing. Different blocks
 * may have the same index; then they share their cells. */
static inline size_t mesher__grid_block(const mesher__grid *g, int level, int64_t x, int64_t y,
                                        int64_t z)
{
    uint64_t k = (uint64_t)x * 0x9e3779b97f4a7c15u + (uint64_t)y * 0xc2b2ae3d27d4eb4fu +
                 (uint64_t)z * 0x165667b19e3779f9u +
                 (uint64_t)(int64_t)level * 0xd6e8feb86659fd93u;
    k ^= k >> 32;
    return (size_t)((k * 0xbf58476d1ce4e5b9u) >> 24) & g->mask;
}

/* The cell around x: 64 times the index of its block, plus its place in the block. */
static inline size_t mesher__grid_cell(const mesher__grid *g, int level, const double *x)
{
    double scale = mesher__power(-level);
    int64_t c[3];
    int i;
    for (i = 0; i < 3; i++) c[i] = (int64_t)((x[i] - g->origin[i]) * scale);
    return mesher__grid_block(g, level, c[0] >> 2, c[1] >> 2, c[2] >> 2) << 6 |
           (size_t)((c[0] & 3) | (c[1] & 3) << 2 | (c[2] & 3) << 4);
}

/* The first point of a cell, plus 1, or 0. */
static inline uint32_t mesher__grid_first(const mesher__grid *g, size_t cell)
{
    return g->used[cell >> 6] >> (cell & 63) & 1 ? g->cells[cell] : 0;
}

/* Empties a grid, and makes room for about the given number of points. */
static int mesher__grid_reset(mesher__grid *g, delaunay_memory *memory, size_t points)
{
    size_t blocks = 1;
    while (64 * blocks < points + points / 2) blocks *= 2;
    if (!mesher__room(memory, &g->used, &g->cap_used, 0, blocks, sizeof *g->used) ||
        !mesher__room(memory, &g->cells, &g->cap_cells, 0, 64 * blocks, sizeof *g->cells) ||
        !mesher__room(memory, &g->spots, &g->cap_spots, 0, points, sizeof *g->spots))
        return 0;
    memset(g->used, 0, blocks * sizeof *g->used);
    g->num_spots = 0;
    g->mask = blocks - 1;
    g->low = 5000;
    g->high = -5000;
    return 1;
}

static void mesher__grid_free(mesher__grid *g, delaunay_memory *memory)
{
    delaunay_release(memory, g->used);
    delaunay_release(memory, g->cells);
    delaunay_release(memory, g->spots);
    g->used = NULL;
    g->cells = NULL;
    g->spots = NULL;
    g->cap_used = g->cap_cells = g->cap_spots = 0;
}

/* The cells low to high along one axis, as far as they are in block b: bits of its four cells. */
static inline unsigned mesher__grid_bits(int64_t low, int64_t high, int64_t b)
{
    int64_t from = low - 4 * b, to = high - 4 * b;
    if (from < 0) from = 0;
    if (to > 3) to = 3;
    return (2u << to) - (1u << from);
}

/* Lists the first points of those cells of a block whose bits are set, and prefetches them.
 * Returns how many there are. */
static inline uint32_t mesher__first_points(const mesher__grid *g, size_t block, uint64_t bits,
                                            uint32_t *list)
{
    uint32_t n = 0;
    for (bits &= g->used[block]; bits; bits &= bits - 1) {
        list[n] = g->cells[block << 6 | mesher__lowest_bit(bits)];
        MESHER__PREFETCH(g->spots + (list[n] - 1));
        n++;
    }
    return n;
}

/* The largest size up to h that a point at x may have for its distance from the points of count
 * cells, whose first points are listed; unit: the cell width of their level. Below least, it stops
 * early. */
static inline double mesher__leave(const mesher__grid *g, const double *x, double h, double least,
                                   double unit, const uint32_t *list, uint32_t count)
{
    uint32_t k, q;
    for (k = 0; k < count && h >= least; k++)
        for (q = list[k]; q;) {
            const mesher__spot *spot = g->spots + (q - 1);
            double size = unit * (double)spot->h;
            if (mesher__too_near(x, spot->x, h + size))
                h = 2 / MESHER__SPACING * mesher__distance(x, spot->x) - size;
            q = spot->next;
        }
    return h;
}

/* The same for all points of a level up to reach (in cell widths, below 1.5) away. An answer below
 * least means only that there is no room for least. */
static inline double mesher__leave_at(const mesher__grid *g, const double *x, double h,
                                      double least, int level, double reach)
{
    static const uint64_t in_y[16] = {0x0,    0x1,    0x10,   0x11,   0x100,  0x101,
                                      0x110,  0x111,  0x1000, 0x1001, 0x1010, 0x1011,
                                      0x1100, 0x1101, 0x1110, 0x1111};
    const double scale = mesher__power(-level), unit = mesher__power(level);
    uint32_t list[64], n = 0;
    int64_t low[3], high[3], i, j, k;
    int d;
    for (d = 0; d < 3; d++) {
        double at = (x[d] - g->origin[d]) * scale;
        low[d] = (int64_t)(at - reach);
        high[d] = (int64_t)(at + reach);
        if (high[d] > low[d] + 3) high[d] = low[d] + 3;
    }
    for (k = low[2] >> 2; k <= high[2] >> 2; k++) {
        unsigned z = mesher__grid_bits(low[2], high[2], k);
        uint64_t in_z = (z & 1) | (uint64_t)(z & 2) << 15 | (uint64_t)(z & 4) << 30 |
                        (uint64_t)(z & 8) << 45;
        for (j = low[1] >> 2; j <= high[1] >> 2; j++) {
            uint64_t in_yz = in_z * in_y[mesher__grid_bits(low[1], high[1], j)];
            for (i = low[0] >> 2; i <= high[0] >> 2; i++)
                n += mesher__first_points(g, mesher__grid_block(g, level, i, j, k),
                                          in_yz * mesher__grid_bits(low[0], high[0], i),
                                          list + n);
        }
    }
    return mesher__leave(g, x, h, least, unit, list, n);
}

/* Points whose sizes differ by more than this factor may miss each other in a grid: because of the
 * gradation hardly any such points are near each other, and the insertion tests again. */
#define MESHER__ALIKE 1.33

/* The largest size up to h that a point at x may have for its distance from the points of a grid.
 * An answer below least means only that there is no room for least. */
static double mesher__room_at(const mesher__grid *g, const double *x, double h, double least)
{
    int level = mesher__level(h);
    if (level < g->low || level > g->high) return h;
    return mesher__leave_at(g, x, h, least, level,
                            0.5 * MESHER__SPACING * (1 + MESHER__ALIKE) * h *
                                mesher__power(-level));
}

/* Is no point in the grid too near for a point of size h at x? */
static int mesher__is_alone(const mesher__grid *g, const double *x, double h)
{
    return mesher__room_at(g, x, h, h) >= h;
}

/* Is a point in the grid too near for one of size h at x? A quick test, for points that will be
 * tested again: it looks at the nearest cells of the level of h only. */
static int mesher__is_crowded(const mesher__grid *g, const double *x, double h)
{
    int level = mesher__level(h);
    return mesher__leave_at(g, x, h, h, level,
                            0.5 * MESHER__SPACING * h * mesher__power(-level)) < h;
}

/* Puts a point in one level. */
static int mesher__put_in_level(mesher__grid *g, delaunay_memory *memory, int level,
                                const double *x, double h)
{
    size_t cell = mesher__grid_cell(g, level, x), n = g->num_spots;
    mesher__spot *spot;
    if (!mesher__room(memory, &g->spots, &g->cap_spots, n, n + 1, sizeof *g->spots)) return 0;
    spot = g->spots + n;
    memcpy(spot->x, x, sizeof spot->x);
    spot->h = (float)(h * mesher__power(-level));
    spot->next = mesher__grid_first(g, cell);
    g->cells[cell] = (uint32_t)++g->num_spots;
    g->used[cell >> 6] |= (uint64_t)1 << (cell & 63);
    if (level < g->low) g->low = level;
    if (level > g->high) g->high = level;
    return 1;
}

static int mesher__put_in_grid(mesher__refiner *r, const mesher__proposal *p)
{
    int level = mesher__level(p->h / MESHER__ALIKE), last = mesher__level(p->h * MESHER__ALIKE);
    for (; level <= last; level++)
        if (!mesher__put_in_level(&r->grid, r->memory, level, p->x, p->h)) return 0;
    return 1;
}

/* -- proposals */

/* The circumcentre x of a tetrahedron. Returns the squared circumradius, or -1 if the tetrahedron
 * is flat. */
static double mesher__circumcentre(const double *a, const double *b, const double *c,
                                   const double *d, double *x)
{
    double u[3], v[3], w[3], vw[3], uu, vv, ww, det;
    int i;
    for (i = 0; i < 3; i++) {
        u[i] = b[i] - a[i];
        v[i] = c[i] - a[i];
        w[i] = d[i] - a[i];
    }
    vw[0] = v[1] * w[2] - v[2] * w[1];
    vw[1] = v[2] * w[0] - v[0] * w[2];
    vw[2] = v[0] * w[1] - v[1] * w[0];
    uu = u[0] * u[0] + u[1] * u[1] + u[2] * u[2];
    vv = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
    ww = w[0] * w[0] + w[1] * w[1] + w[2] * w[2];
    det = 2 * (u[0] * vw[0] + u[1] * vw[1] + u[2] * vw[2]);
    if (!(det > 0)) return -1;
    for (i = 0; i < 3; i++) {
        int j = (i + 1) % 3, k = (i + 2) % 3;
        x[i] = (uu * vw[i] + vv * (w[j] * u[k] - w[k] * u[j]) + ww * (u[j] * v[k] - u[k] * v[j])) /
               det;
    }
    uu = x[0] * x[0] + x[1] * x[1] + x[2] * x[2];
    for (i = 0; i < 3; i++) x[i] += a[i];
    return uu;
}

/* Walks from tetrahedron t to the one that contains x. Returns 0 if a constrained facet, the end of
 * the mesh or a cycle stops it; *facet is then the constrained facet or end that was met, or 0. */
static delaunay_handle mesher__see(const delaunay_mesh *mesh, const double *x, delaunay_handle t,
                                   delaunay_handle *facet)
{
    double w[4];
    int step, i;
    *facet = 0;
    for (step = 0; step < 100; step++) {
        int k = 0;
        mesher__weights(mesh->vertices, mesh->tets[t].v, x, w);
        for (i = 1; i < 4; i++)
            if (w[i] < w[k]) k = i;
        if (w[k] >= 0) return t;
        if ((mesh->flags[t] & DELAUNAY_FACET_BIT(k)) || !mesh->tets[t].n[k]) {
            *facet = 4 * t + (delaunay_handle)k;
            return 0;
        }
        t = mesh->tets[t].n[k] >> 2;
        if (delaunay_is_ghost(mesh, t)) return 0;
    }
    return 0;
}

/* Is p far enough from all corners of tetrahedron t, if its size is h? */
static int mesher__is_clear(const mesher__refiner *r, const mesher__proposal *p, double h,
                            delaunay_handle t)
{
    int i;
    for (i = 0; i < 4; i++) {
        uint32_t v = r->mesh->tets[t].v[i];
        if (mesher__too_near(p->x, r->mesh->vertices[v].x, h + r->domain->size[v])) return 0;
    }
    return 1;
}

/* The wanted apex x over facet i of tetrahedron t, on the side of t: its distance from the corners
 * of the facet is reach times their mean size. If the facet is obtuse, it is over the centroid; if
 * the facet is large, its height is 0.6 times that distance. Returns 0 if the facet has no normal.
 */
static int mesher__apex(const mesher__refiner *r, delaunay_handle t, int i, double reach,
                        double *x)
{
    const delaunay_mesh *mesh = r->mesh;
    const uint8_t *f = delaunay_facet_order(i);
    const double *p[3];
    double n[3], c[3], u[3], v[3], h = 0, uu, vv, uv, nn, s, q, rr, height;
    int k;
    for (k = 0; k < 3; k++) {
        uint32_t corner = mesh->tets[t].v[f[k]];
        p[k] = mesh->vertices[corner].x;
        h += reach / 3 * r->domain->size[corner];
    }
    for (k = 0; k < 3; k++) {
        u[k] = p[1][k] - p[0][k];
        v[k] = p[2][k] - p[0][k];
    }
    n[0] = u[1] * v[2] - u[2] * v[1];
    n[1] = u[2] * v[0] - u[0] * v[2];
    n[2] = u[0] * v[1] - u[1] * v[0];
    uu = u[0] * u[0] + u[1] * u[1] + u[2] * u[2];
    vv = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
    uv = u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
    nn = n[0] * n[0] + n[1] * n[1] + n[2] * n[2];
    if (!(nn > 0)) return 0;
    s = vv * (uu - uv) / (2 * nn);
    q = uu * (vv - uv) / (2 * nn);
    if (s < 0.1 || q < 0.1 || s + q > 0.9) s = q = 1 / 3.0; /* obtuse: over the middle */
    rr = 0;
    for (k = 0; k < 3; k++) {
        double d = s * u[k] + q * v[k];
        c[k] = p[0][k] + d;
        rr += d * d;
    }
    height = h * h > 1.5625 * rr ? sqrt(h * h - rr) : 0.6 * h;
    height /= -sqrt(nn);
    for (k = 0; k < 3; k++) x[k] = c[k] + height * n[k];
    return 1;
}

static int mesher__in_box(const mesher__refiner *r, const double *x)
{
    const double *lo = r->box.lo, *hi = r->box.hi;
    return x[0] > lo[0] && x[1] > lo[1] && x[2] > lo[2] && x[0] < hi[0] && x[1] < hi[1] &&
           x[2] < hi[2];
}

/* Bounds the size at p by what has grown from the corners of tetrahedron t. */
static void mesher__bound_growth(const mesher__refiner *r, mesher__proposal *p, delaunay_handle t)
{
    const uint32_t *v = r->mesh->tets[t].v;
    int i;
    for (i = 0; i < 4; i++) {
        const double size = r->domain->size[v[i]],
                     h = size + r->field.slope * mesher__distance(p->x, r->mesh->vertices[v[i]].x);
        if (size > 0 && h < p->h) p->h = h;
    }
}

/* Finds the tetrahedron that contains p->x, by a walk from tetrahedron `from`, and the size there.
 * Returns 0 if the walk does not get there; *met is then the facet in the way, if any. Where sizes
 * grow and nothing else bounds them, those at the corners of tetrahedron `source`, which asks for
 * p, take the place of all: few vertices are nearer. */
static int mesher__settle(const mesher__refiner *r, mesher__proposal *p, delaunay_handle source,
                          delaunay_handle from, delaunay_handle *met)
{
    int found;
    p->tet = mesher__see(r->mesh, p->x, from, met);
    if (!p->tet) return 0;
    *met = 0;
    if (!mesher__in_box(r, p->x)) return 0; /* so far away that rounding decides what is seen */
    if (mesher__has_wishes(r->options)) { /* without the function, which is called in batches */
        p->h = mesher__size_at(&r->field, p->x, &p->home, &found);
        p->h = mesher__clamp_size(r->options, mesher__wish_at(r->options, p->x, p->region, p->h));
        return 1;
    }
    p->h = mesher__field_at(&r->field, p->x, &p->home, &found);
    if (r->options->growth > 1) {
        mesher__bound_growth(r, p, source);
        mesher__bound_growth(r, p, p->tet);
    }
    return 1;
}

static uint32_t mesher__stamp(const delaunay_mesh *mesh, delaunay_handle t)
{
    const uint32_t *v = mesh->tets[t].v;
    return v[0] ^ v[1] * 3 ^ v[2] * 5 ^ v[3] * 7;
}

/* A tetrahedron whose corner sizes have this sum and maximum is small if its circumradius is below
 * the bound: then there is no room for the circumcentre nor, if one corner has a much larger size
 * than the others, for the apex over the facet of those. */
static inline double mesher__bound(double sum, double most)
{
    double rest = (sum - most) / 3;
    if (most >= MESHER__UNEVEN * rest) return MESHER__SPACING * rest;
    return 0.98 * MESHER__SPACING / 2 * (sum / 4 + most);
}

/* How far the next vertex should be, relative to the size here, if sizes grow by so much across a
 * sphere of squared radius rr: as far as the mean of the sizes at both ends, but at most twice the
 * size here. */
static double mesher__reach(double growth, double rr)
{
    double slope = growth / (2 * sqrt(rr));
    return 1 / (1 - 0.5 * (slope < 1 ? slope : 1));
}

/* What a tetrahedron answers: no point; perhaps one later, as another is in the way; a point. */
enum { MESHER__SMALL = 1, MESHER__CROWDED, MESHER__POINT };

/* What sizes that grow allow at the circumcentre of tetrahedron t, whose distance from its corners
 * is radius: other vertices are hardly nearer. */
static double mesher__grown_to_centre(const mesher__refiner *r, delaunay_handle t, double radius)
{
    const uint32_t *v = r->mesh->tets[t].v;
    const double *size = r->domain->size;
    double h = size[v[0]];
    int i;
    for (i = 1; i < 4; i++)
        if (size[v[i]] < h) h = size[v[i]];
    h += r->field.slope * radius;
    return h < r->field.cap ? h : r->field.cap;
}

/* Can the point p->x that tetrahedron t asks for stay where it is? Returns 1 if so; 0 if it is too
 * near to a corner; -1 if a walk from tetrahedron `from` does not get there: facet *met, if any, is
 * in the way. The search for its size starts at the given corner of t. */
static int mesher__suits(const mesher__refiner *r, mesher__proposal *p, delaunay_handle t,
                         delaunay_handle from, int corner, delaunay_handle *met)
{
    double h;
    p->home = r->home[r->mesh->tets[t].v[corner]];
    if (!mesher__settle(r, p, t, from, met)) return -1;
    h = r->options->size_function ? 0 : p->h; /* the function may ask for much less */
    return mesher__is_clear(r, p, h, t) && mesher__is_clear(r, p, h, p->tet);
}

/* Finds the point that tetrahedron t asks for, if t is too large. Returns MESHER__POINT;
 * MESHER__CROWDED: a point of the harvest h (which may be NULL) is probably in its way;
 * MESHER__SMALL: t is small enough, or no place suits. */
static int mesher__propose(const mesher__refiner *r, delaunay_handle t, mesher__proposal *p,
                           const mesher__harvest *h)
{
    const delaunay_mesh *mesh = r->mesh;
    const uint32_t *v = mesh->tets[t].v;
    const double *x[4], *size = r->domain->size;
    double rr, bound, most, rest, sum = 0;
    delaunay_handle met;
    int i, least = 0, largest = 0, suits;
    for (i = 0; i < 4; i++) {
        x[i] = mesh->vertices[v[i]].x;
        sum += size[v[i]];
        if (size[v[i]] > size[v[largest]]) largest = i;
        if (size[v[i]] < size[v[least]]) least = i;
    }
    most = size[v[largest]];
    rest = (sum - most) / 3;
    rr = mesher__circumcentre(x[0], x[1], x[2], x[3], p->x);
    bound = mesher__bound(sum, most);
    if (rr >= 0 && rr < bound * bound) return MESHER__SMALL;
    p->source = t;
    p->stamp = mesher__stamp(mesh, t);
    p->region = mesh->color[t];
    p->vertex = 0;
    p->start = 0;
    p->state = 0;
    if (rr >= 0 && h && mesher__in_box(r, p->x) &&
        mesher__is_crowded(&h->grid, p->x, r->options->growth > 1
                                               ? mesher__grown_to_centre(r, t, sqrt(rr))
                                               : sum / 4))
        return MESHER__CROWDED;
    suits = rr >= 0 ? mesher__suits(r, p, t, t, least, &met) : -1;
    if (suits == 0 && most >= MESHER__UNEVEN * rest &&
        mesher__apex(r, t, largest, mesher__reach(most - rest, rr), p->x))
        suits = mesher__suits(r, p, t, t, least, &met) == 1;
    else if (rr >= 0 && suits < 0 && met && mesher__apex(r, met >> 2, (int)(met & 3), 1, p->x))
        suits = mesher__suits(r, p, t, met >> 2, least, &met);
    if (suits < 0) {
        for (i = 0; i < 3; i++) p->x[i] = (x[0][i] + x[1][i] + x[2][i] + x[3][i]) / 4;
        suits = mesher__suits(r, p, t, t, least, &met);
    }
    return suits == 1 ? MESHER__POINT : MESHER__SMALL;
}

/* Bounds the sizes of count proposals, stride bytes apart, by the caller's wishes, in batches that
 * the threads share. */
static void mesher__wish_at_points(mesher__refiner *r, mesher__proposal *points, size_t stride,
                                   size_t count)
{
    int threads = count > 2 * MESHER__BATCH ? delaunay_threads(&r->options->host) : 1, b;
    int batches = (int)((count + MESHER__BATCH - 1) / MESHER__BATCH);
    uint64_t ignored = 0;
    if (!mesher__has_wishes(r->options)) return;
    (void)threads;
    /* Shared: the points, each of one batch; private: the batch's arrays. */
    MESHER__OMP(omp parallel for schedule(dynamic, 1) num_threads(threads)                         \
                    reduction(+ : ignored) if(threads > 1))
    for (b = 0; b < batches; b++) {
        double xyz[3 * MESHER__BATCH], h[MESHER__BATCH];
        uint32_t region[MESHER__BATCH];
        size_t first = (size_t)b * MESHER__BATCH,
               n = count - first < MESHER__BATCH ? count - first : (size_t)MESHER__BATCH, i;
        for (i = 0; i < n; i++) {
            const mesher__proposal *p =
                (const mesher__proposal *)(const void *)((const char *)points +
                                                         (first + i) * stride);
            memcpy(xyz + 3 * i, p->x, sizeof p->x);
            region[i] = p->region;
            h[i] = p->h;
        }
        ignored += mesher__wishes(r->options, n, xyz, region, h);
        for (i = 0; i < n; i++) {
            mesher__proposal *p =
                (mesher__proposal *)(void *)((char *)points + (first + i) * stride);
            p->h = mesher__floored(&r->field, h[i]);
        }
    }
    r->ignored += ignored;
}

/* Applies the caller's bounds to the sizes of all proposals of the sweep. */
static void mesher__bound_points(mesher__refiner *r)
{
    size_t i;
    for (i = 0; i < r->num_points; i++)
        r->points[i].h =
            mesher__floored(&r->field, mesher__clamp_size(r->options, r->points[i].h));
}

/* Counts that the point of tetrahedron t lost against another. */
static void mesher__lose(delaunay_mesh *mesh, delaunay_handle t)
{
    unsigned flags = mesh->flags[t];
    if ((flags & MESHER__LOST_MASK) == MESHER__LOST_MASK) flags |= MESHER__SEEN;
    else flags += MESHER__LOST;
    mesh->flags[t] = (uint16_t)flags;
}

#ifdef MESHER__SIMD
/* Loads corner i of four tetrahedra, relative to p, and its squared distance from p. */
#    define MESHER__LOAD(i, ox, oy, oz, l)                                                         \
      do {                                                                                         \
        __m256d r0 = _mm256_load_pd(vertices[v0[i]].x), r1 = _mm256_load_pd(vertices[v1[i]].x);    \
        __m256d r2 = _mm256_load_pd(vertices[v2[i]].x), r3 = _mm256_load_pd(vertices[v3[i]].x);    \
        __m256d s0 = _mm256_unpacklo_pd(r0, r1), s1 = _mm256_unpackhi_pd(r0, r1);                  \
        __m256d s2 = _mm256_unpacklo_pd(r2, r3), s3 = _mm256_unpackhi_pd(r2, r3);                  \
        ox = _mm256_sub_pd(_mm256_permute2f128_pd(s0, s2, 0x20), px);                              \
        oy = _mm256_sub_pd(_mm256_permute2f128_pd(s1, s3, 0x20), py);                              \
        oz = _mm256_sub_pd(_mm256_permute2f128_pd(s0, s2, 0x31), pz);                              \
        l = _mm256_add_pd(_mm256_add_pd(_mm256_mul_pd(ox, ox), _mm256_mul_pd(oy, oy)),             \
                          _mm256_mul_pd(oz, oz));                                                  \
      } while (0)
#define MESHER__CROSS(a, b, c, d) _mm256_sub_pd(_mm256_mul_pd(a, b), _mm256_mul_pd(c, d))

/* Bits of those of four tetrahedra whose circumspheres are clearly so small that mesher__propose
 * would answer MESHER__SMALL. Leaves out any that is so flat that rounding could make a
 * difference. */
__attribute__((target("avx2"))) static int mesher__are_small4(const delaunay_vertex *vertices,
                                                              const double *size,
                                                              const delaunay_tet *const *t)
{
    const uint32_t *v0 = t[0]->v, *v1 = t[1]->v, *v2 = t[2]->v, *v3 = t[3]->v;
    __m256d px = _mm256_setzero_pd(), py = px, pz = px;
    __m256d ux, uy, uz, uu, vx, vy, vz, vv, wx, wy, wz, ww, x, y, z, det, rr;
    double bound[4];
    int i, k;
    for (k = 0; k < 4; k++) {
        double sum = 0, most = 0, b;
        for (i = 0; i < 4; i++) {
            double h = size[t[k]->v[i]];
            sum += h;
            most = most > h ? most : h;
        }
        b = mesher__bound(sum, most);
        bound[k] = 0.999 * b * b;
    }
    MESHER__LOAD(0, x, y, z, uu);
    px = x, py = y, pz = z;
    MESHER__LOAD(1, ux, uy, uz, uu);
    MESHER__LOAD(2, vx, vy, vz, vv);
    MESHER__LOAD(3, wx, wy, wz, ww);
    x = MESHER__CROSS(vy, wz, vz, wy);
    y = MESHER__CROSS(vz, wx, vx, wz);
    z = MESHER__CROSS(vx, wy, vy, wx);
    det = _mm256_add_pd(_mm256_add_pd(_mm256_mul_pd(ux, x), _mm256_mul_pd(uy, y)),
                        _mm256_mul_pd(uz, z));
    x = _mm256_add_pd(_mm256_mul_pd(uu, x),
                      _mm256_add_pd(_mm256_mul_pd(vv, MESHER__CROSS(wy, uz, wz, uy)),
                                    _mm256_mul_pd(ww, MESHER__CROSS(uy, vz, uz, vy))));
    y = _mm256_add_pd(_mm256_mul_pd(uu, y),
                      _mm256_add_pd(_mm256_mul_pd(vv, MESHER__CROSS(wz, ux, wx, uz)),
                                    _mm256_mul_pd(ww, MESHER__CROSS(uz, vx, ux, vz))));
    z = _mm256_add_pd(_mm256_mul_pd(uu, z),
                      _mm256_add_pd(_mm256_mul_pd(vv, MESHER__CROSS(wx, uy, wy, ux)),
                                    _mm256_mul_pd(ww, MESHER__CROSS(ux, vy, uy, vx))));
    rr = _mm256_add_pd(_mm256_add_pd(_mm256_mul_pd(x, x), _mm256_mul_pd(y, y)),
                       _mm256_mul_pd(z, z));
    y = _mm256_mul_pd(det, det);
    x = _mm256_mul_pd(_mm256_mul_pd(_mm256_loadu_pd(bound), y), _mm256_set1_pd(4));
    z = _mm256_mul_pd(_mm256_mul_pd(_mm256_set1_pd(1e-20), uu), _mm256_mul_pd(vv, ww));
    x = _mm256_and_pd(_mm256_cmp_pd(x, rr, _CMP_GT_OQ), _mm256_cmp_pd(y, z, _CMP_GT_OQ));
    x = _mm256_and_pd(x, _mm256_cmp_pd(det, _mm256_set1_pd(1e-290), _CMP_GT_OQ));
    return _mm256_movemask_pd(x);
}
#endif

/* Answers MESHER__SMALL for those of up to four tetrahedra whose circumspheres are clearly small,
 * and takes them off the list. Returns how many are left. */
static int mesher__sieve(const mesher__refiner *r, delaunay_handle *list, int count)
{
#ifdef MESHER__SIMD
    delaunay_mesh *mesh = r->mesh;
    const delaunay_tet *t[4];
    int k, little, left = 0;
    if (!r->cavity.simd || count == 0) return count;
    for (k = 0; k < 4; k++) t[k] = mesh->tets + list[k < count ? k : 0];
    little = mesher__are_small4(mesh->vertices, r->domain->size, t);
    for (k = 0; k < count; k++) {
        if (little >> k & 1) mesh->mark[list[k]] = MESHER__SMALL;
        else list[left++] = list[k];
    }
    return left;
#else
    (void)r;
    (void)list;
    return count;
#endif
}

/* Asks tetrahedron t; keeps its point, if any, in the harvest. */
static void mesher__ask(const mesher__refiner *r, mesher__harvest *h, delaunay_handle t)
{
    int alone = !mesher__has_wishes(r->options);
    mesher__proposal *p = h->points + h->num_points;
    int answer = mesher__propose(r, t, p, alone ? h : NULL);
    r->mesh->mark[t] = (uint8_t)answer; /* not in the flags: other threads read those */
    if (answer != MESHER__POINT) return;
    if (alone) mesher__put_in_level(&h->grid, r->memory, mesher__level(p->h), p->x, p->h);
    h->num_points++;
}

/* Prefetches the corners of a tetrahedron that will be asked, and their sizes. */
static inline void mesher__fetch_corners(const mesher__refiner *r, delaunay_handle t)
{
    const uint32_t *v = r->mesh->tets[t].v;
    int i;
    if (r->mesh->flags[t] & MESHER__SEEN) return;
    for (i = 0; i < 4; i++) {
        MESHER__PREFETCH(r->mesh->vertices + v[i]);
        MESHER__PREFETCH(r->domain->size + v[i]);
    }
}

/* Do the flags of four tetrahedra say that all of them need not be asked? */
static inline int mesher__are_seen(const uint16_t *flags)
{
    const uint64_t seen = (uint64_t)MESHER__SEEN * 0x0001000100010001u;
    uint64_t four;
    memcpy(&four, flags, sizeof four);
    return (four & seen) == seen;
}

/* Gathers the points that the tetrahedra of a range of slots ask for. */
static void mesher__gather_some(const mesher__refiner *r, mesher__harvest *h, delaunay_handle begin,
                                delaunay_handle end)
{
    enum { MESHER__AHEAD = 16 };
    delaunay_mesh *mesh = r->mesh;
    delaunay_handle t, list[4];
    int count = 0, k;
    h->num_points = 0;
    mesher__grid_reset(&h->grid, r->memory, MESHER__SLOTS);
    for (t = begin; t < end; t++) {
        if (end - t >= MESHER__AHEAD + 4) {
            if (mesher__are_seen(mesh->flags + t) &&
                mesher__are_seen(mesh->flags + t + MESHER__AHEAD)) {
                t += 3;
                continue;
            }
            mesher__fetch_corners(r, t + MESHER__AHEAD);
        }
        if (!(mesh->flags[t] & MESHER__SEEN)) {
            if (mesher__is_inside(mesh, t)) list[count++] = t;
            else mesh->mark[t] = MESHER__SMALL;
        }
        if (count < 4) continue;
        count = mesher__sieve(r, list, count);
        for (k = 0; k < count; k++) mesher__ask(r, h, list[k]);
        count = 0;
    }
    count = mesher__sieve(r, list, count);
    for (k = 0; k < count; k++) mesher__ask(r, h, list[k]);
}

/* Moves the answers of the tetrahedra of a range of slots from the marks to the flags. */
static void mesher__note_answers(delaunay_mesh *mesh, delaunay_handle begin, delaunay_handle end)
{
    delaunay_handle t;
    uint64_t eight;
    for (t = begin; t < end; t++) {
        if (end - t >= 8) {
            memcpy(&eight, mesh->mark + t, sizeof eight);
            if (eight == 0) {
                t += 7;
                continue;
            }
        }
        if (mesh->mark[t] == MESHER__SMALL) mesh->flags[t] |= MESHER__SEEN;
        if (mesh->mark[t] == MESHER__CROWDED) mesher__lose(mesh, t);
        mesh->mark[t] = 0;
    }
}

/* Makes room for the harvests, so that threads need not allocate. */
static int mesher__harvests(mesher__refiner *r, int count)
{
    int i;
    if (count > r->num_harvests) {
        mesher__harvest *all = (mesher__harvest *)delaunay_grow_zeroed(
            r->memory, r->harvests, (size_t)r->num_harvests, (size_t)count, sizeof *all);
        if (!all) return 0;
        r->harvests = all;
        r->num_harvests = count;
    }
    for (i = 0; i < count; i++) {
        mesher__harvest *h = r->harvests + i;
        memcpy(h->grid.origin, r->grid.origin, sizeof h->grid.origin);
        if (!mesher__room(r->memory, &h->points, &h->cap_points, 0, MESHER__SLOTS,
                          sizeof *h->points) ||
            !mesher__grid_reset(&h->grid, r->memory, MESHER__SLOTS))
            return 0;
    }
    return 1;
}

/* Gathers the points of all tetrahedra that are still to be asked, in the order of the slots. */
static int mesher__gather(mesher__refiner *r)
{
    int threads = delaunay_threads(&r->options->host), count = threads > 1 ? 4 * threads : 1, i, n;
    size_t slots = r->mesh->num_tets, first;
    double work;
    r->num_points = 0;
    if (!mesher__harvests(r, count)) return 0;
    for (first = 1; first < slots; first += (size_t)n * MESHER__SLOTS) {
        n = (slots - first + MESHER__SLOTS - 1) / MESHER__SLOTS < (size_t)count
                ? (int)((slots - first + MESHER__SLOTS - 1) / MESHER__SLOTS) : count;
        threads = delaunay_crew_begin(&r->crew, n > 1);
        work = 0;
        /* Shared: the mesh, of which each range writes its own marks, and, when all are through,
         * its own flags; private: a harvest for each range. */
        MESHER__OMP(omp parallel num_threads(threads) private(i) reduction(+ : work))
        {
            double start = delaunay_cpu_seconds();
            MESHER__OMP(omp for schedule(dynamic, 1) nowait)
            for (i = 0; i < n; i++) {
                size_t begin = first + (size_t)i * MESHER__SLOTS, end = begin + MESHER__SLOTS;
                mesher__gather_some(r, r->harvests + i, (delaunay_handle)begin,
                                    (delaunay_handle)(end < slots ? end : slots));
            }
            work += delaunay_cpu_seconds() - start;
            MESHER__OMP(omp barrier)
            start = delaunay_cpu_seconds();
            MESHER__OMP(omp for schedule(static) nowait)
            for (i = 0; i < n; i++) {
                size_t begin = first + (size_t)i * MESHER__SLOTS, end = begin + MESHER__SLOTS;
                mesher__note_answers(r->mesh, (delaunay_handle)begin,
                                     (delaunay_handle)(end < slots ? end : slots));
            }
            work += delaunay_cpu_seconds() - start;
        }
        delaunay_crew_end(&r->crew, work);
        for (i = 0; i < n; i++) {
            const mesher__harvest *h = r->harvests + i;
            if (!mesher__room(r->memory, &r->points, &r->cap_points, r->num_points,
                              r->num_points + h->num_points, sizeof *r->points))
                return 0;
            if (h->num_points)
                memcpy(r->points + r->num_points, h->points, h->num_points * sizeof *h->points);
            r->num_points += h->num_points;
        }
    }
    if (r->options->size_function)
        mesher__wish_at_points(r, r->points, sizeof *r->points, r->num_points);
    else mesher__bound_points(r); /* their sizes take all other wishes into account already */
    return 1;
}

/* Rearranges the array of points in the order of r->order, in which all that follows reads them. If
 * there is no memory for that, they stay where they are. */
static void mesher__arrange_points(mesher__refiner *r)
{
    mesher__proposal *points =
        (mesher__proposal *)delaunay_alloc(r->memory, r->num_points, sizeof *points);
    int threads = delaunay_threads_for(&r->options->host, r->num_points);
    int64_t k, n = (int64_t)r->num_points;
    (void)threads;
    if (!points) return;
    /* Shared: the order, read only, and the points; each place is written once. */
    MESHER__OMP(omp parallel for schedule(static) num_threads(threads))
    for (k = 0; k < n; k++) {
        if (k + 16 < n) MESHER__PREFETCH(r->points + r->order[k + 16].value);
        points[k] = r->points[r->order[k].value];
    }
    for (k = 0; k < n; k++) r->order[k].value = (uint64_t)k;
    delaunay_release(r->memory, r->points);
    r->points = points;
    r->cap_points = r->num_points;
}

/* Sorts the points along the Hilbert curve. With rounds, in random rounds of growing size, each
 * along the curve [Marot 2020, 3.4], which suits a first insertion into a coarse mesh. */
static int mesher__sort_points(mesher__refiner *r, int rounds)
{
    size_t n = r->num_points, k;
    if (!mesher__room(r->memory, &r->order, &r->cap_order, 0, n, sizeof *r->order)) return 0;
    if (!mesher__room(r->memory, &r->keys, &r->cap_keys, 0, n, sizeof *r->keys)) return 0;
    if (n == 0) return 1;
    if (hilbert_keys3(r->keys, r->points[0].x, sizeof *r->points, n, &r->box,
                      r->options->host.num_threads) != HILBERT_OK)
        return 0;
    for (k = 0; k < n; k++) {
        uint32_t hash = (uint32_t)(k * 0x9e3779b97f4a7c15u >> 32), round = 15;
        for (; rounds && round && (hash & 7) == 0; hash >>= 3) round--;
        r->order[k].key = rounds ? r->keys[k] >> 4 | (uint64_t)round << 60 : r->keys[k];
        r->order[k].value = k;
    }
    if (mesher__sort(r->domain, r->order, n) != MESHER_OK) return 0;
    mesher__arrange_points(r);
    return 1;
}

/* -- budgets */

static mesher_result mesher__over_budget(mesher__refiner *r, int look_at_clock)
{
    const mesher_options *o = r->options;
    int budget = 0;
    if (r->max_vertices && r->mesh->num_vertices >= r->max_vertices)
        budget = MESHER__BUDGET_VERTICES;
    else if (o->max_tets && r->num_tets + 32 > o->max_tets) budget = MESHER__BUDGET_TETS;
    else if (r->mesh->num_vertices >= UINT32_MAX - 16 ||
             (size_t)r->mesh->num_tets >= ((delaunay_handle)-1) / 4 - 4096)
        budget = MESHER__BUDGET_INDICES;
    else if (look_at_clock && o->max_seconds > 0 &&
             delaunay_seconds(&o->host) - r->start > o->max_seconds)
        budget = MESHER__BUDGET_SECONDS;
    if (!budget) return MESHER_OK;
    r->budget = budget;
    return MESHER_STOPPED_BY_BUDGET;
}

/* How many more points, about, there is memory for within the limit that the caller has set. A
 * point adds seven tetrahedra; the rest is for the lists of points and for arrays that grow. */
static double mesher__memory_for(const mesher__refiner *r)
{
    const size_t limit = r->memory->limit_bytes, used = r->memory->bytes;
    const double point = 16.0 * sizeof(delaunay_tet) + 256;
    if (!limit) return HUGE_VAL;
    return used < limit ? (double)(limit - used) / point : 0;
}

/* The result of running out of memory. If the caller has set a limit, that is a budget, as the mesh
 * is valid. */
static mesher_result mesher__no_memory(mesher__refiner *r)
{
    r->budget = MESHER__BUDGET_MEMORY;
    return r->memory->limit_bytes ? MESHER_STOPPED_BY_BUDGET : MESHER_ERROR_OUT_OF_MEMORY;
}

/* ---- >>lattice  far from the surface, before all sweeps ----------------------------------- */

/* The width of the cubes of the body-centred lattice, relative to the wanted size: the edges of its
 * tetrahedra are 1.04 and 1.2 times that size. */
#  define MESHER__CUBE 1.2
/* The largest relative change of the size from one point of a lattice to the next, and the largest
 * one at which the point need not be moved. */
#  define MESHER__UNIFORM 0.1
#  define MESHER__SAME 0.03
/* A lattice starts only where there is room for a point of this many times the size. */
#  define MESHER__ROOM_TO_START 1.5
/* With fewer points than this a lattice is not worth its while, unless there are starts that would
 * not be noticed otherwise. */
#  define MESHER__LATTICE_LEAST 8
/* If there would be more points than this, the host is warned, and all are left to the sweeps,
 * which stop at budgets. */
#  define MESHER__LATTICE_MOST 3e8

/* Sets h to the sizes wanted at the centroids of the tetrahedra from first to end - 1 (a batch, or
 * fewer), 0 for those not inside. The background still has the same tetrahedra as the mesh.
 * Returns how many answers of the size function were no size. */
static uint64_t mesher__sizes_in(const mesher__refiner *r, delaunay_handle first,
                                 delaunay_handle end, double *h)
{
    const delaunay_mesh *mesh = r->mesh;
    double xyz[3 * MESHER__BATCH], size[MESHER__BATCH];
    uint32_t region[MESHER__BATCH];
    uint64_t ignored;
    delaunay_handle t;
    size_t n = 0;
    int i, found;
    for (t = first; t < end; t++) {
        const uint32_t *v = mesh->tets[t].v;
        delaunay_handle home = t;
        double *x = xyz + 3 * n;
        if (!mesher__is_inside(mesh, t)) continue;
        for (i = 0; i < 3; i++)
            x[i] = (mesh->vertices[v[0]].x[i] + mesh->vertices[v[1]].x[i] +
                    mesh->vertices[v[2]].x[i] + mesh->vertices[v[3]].x[i]) /
                   4;
        region[n] = mesh->color[t];
        size[n++] = mesher__field_at(&r->field, x, &home, &found);
    }
    ignored = n ? mesher__wishes(r->options, n, xyz, region, size) : 0;
    for (n = 0, t = first; t < end; t++, h++) {
        *h = 0;
        if (!mesher__is_inside(mesh, t)) continue;
        *h = mesher__floored(&r->field, size[n]);
        n++;
    }
    return ignored;
}

/* Does the cell of x list a point that is much nearer than the size h? It will do for both. */
static int mesher__is_covered(const mesher__grid *g, const double *x, double h)
{
    uint32_t q = mesher__grid_first(g, mesher__grid_cell(g, mesher__level(h), x));
    for (; q; q = g->spots[q - 1].next)
        if (mesher__too_near(x, g->spots[q - 1].x, 0.5 * h)) return 1;
    return 0;
}

/* Puts the vertices inside into r->points and the grid, so that lattices keep their distance from
 * them; without those that are covered by another. */
static int mesher__put_vertices(mesher__refiner *r)
{
    uint32_t v;
    if (!mesher__room(r->memory, &r->points, &r->cap_points, 0, r->mesh->num_vertices,
                      sizeof *r->points))
        return 0;
    r->num_points = 0;
    for (v = 1; v < r->mesh->num_vertices; v++) {
        mesher__proposal *p = r->points + r->num_points;
        if (!r->home[v] || !(r->domain->size[v] > 0)) continue;
        memcpy(p->x, r->mesh->vertices[v].x, sizeof p->x);
        p->h = r->domain->size[v];
        if (mesher__is_covered(&r->grid, p->x, p->h)) continue;
        if (!mesher__put_in_grid(r, p)) return 0;
        r->num_points++;
    }
    return 1;
}

/* Puts p at x, and finds its size, by a search from home. Returns whether x is in the region. */
static int mesher__place(const mesher__refiner *r, mesher__proposal *p, const double *x,
                         delaunay_handle home, uint32_t region)
{
    int found;
    memcpy(p->x, x, sizeof p->x);
    p->home = home;
    p->region = region;
    p->source = p->tet = 0;
    p->vertex = 0;
    p->start = 0;
    p->state = 0;
    p->h = mesher__size_at(&r->field, x, &p->home, &found);
    return found && r->field.color[p->home] == region;
}

/* The neighbour of a node in one of eight directions. A node of a lattice is three coordinates of
 * 16 bits, in halves of the cube's width, and the lattice's number modulo 2^15 in the highest 16.
 * Of two nodes that this makes equal the second one counts as tried; the sweeps fill the gap. */
static uint64_t mesher__next_node(uint64_t node, int direction)
{
    uint64_t x = (node & 0xffff) + (direction & 1 ? 1u : 0xffffu),
             y = (node >> 16 & 0xffff) + (direction & 2 ? 1u : 0xffffu);
    uint64_t z = (node >> 32 & 0xffff) + (direction & 4 ? 1u : 0xffffu);
    return (node & 0xffff000000000000u) | (z & 0xffff) << 32 | (y & 0xffff) << 16 | (x & 0xffff);
}

/* The cube of 4 x 4 x 4 places around a node, sixteen of which are nodes of the lattice. */
static inline uint64_t mesher__cube_of(uint64_t node)
{
    return node & 0xfffffffcfffcfffcu;
}

static inline size_t mesher__cube_slot(const mesher__refiner *r, uint64_t cube)
{
    size_t k = (size_t)(((cube ^ cube >> 29) * 0x9e3779b97f4a7c15u) >> 20) & (r->cap_seen - 1);
    while (r->seen[k].bits && r->seen[k].cube != cube) k = (k + 1) & (r->cap_seen - 1);
    return k;
}

/* Makes room for one more cube in r->seen, whose capacity is a power of two. */
static int mesher__seen_room(mesher__refiner *r)
{
    size_t k, cap = r->cap_seen, more = cap ? 2 * cap : 4096;
    mesher__seen *old = r->seen, *all;
    if (2 * r->num_seen < cap) return 1;
    all = (mesher__seen *)delaunay_alloc_zeroed(r->memory, more, sizeof *all);
    if (!all) return 0;
    r->seen = all;
    r->cap_seen = more;
    for (k = 0; k < cap; k++)
        if (old[k].bits) r->seen[mesher__cube_slot(r, old[k].cube)] = old[k];
    delaunay_release(r->memory, old);
    return 1;
}

/* Enters a node in r->seen. Returns 1 if it is new, 0 if not, -1 if there is no memory. */
static int mesher__see_node(mesher__refiner *r, uint64_t node)
{
    uint64_t cube = mesher__cube_of(node),
             bit = (uint64_t)1 << ((node & 3) | (node >> 14 & 12) | (node >> 28 & 48));
    mesher__seen *s;
    if (!mesher__seen_room(r)) return -1;
    s = r->seen + mesher__cube_slot(r, cube);
    if (s->bits & bit) return 0;
    r->num_seen += !s->bits;
    s->cube = cube;
    s->bits |= bit;
    return 1;
}

/* Makes room for one more point of a lattice. */
static int mesher__lattice_room(mesher__refiner *r)
{
    size_t need = r->num_points + 1;
    return mesher__room(r->memory, &r->points, &r->cap_points, r->num_points, need,
                        sizeof *r->points) &&
           mesher__room(r->memory, &r->nodes, &r->cap_nodes, r->num_points, need, sizeof *r->nodes);
}

/* A candidate: a node beside a point of a batch of up to MESHER__FRONT, all of whose neighbours are
 * tried together. */
enum { MESHER__FRONT = 2048, MESHER__MANY_CANDIDATES = 1024 };
typedef struct mesher__candidate {
    mesher__proposal p;
    uint64_t         node;
    uint32_t         parent, direction;
    double           room; /* the largest size that the points around allow it */
} mesher__candidate;

/* Puts a candidate beside its parent, at the distance that follows from size h there and the
 * parent's size. Returns 0 if another point leaves no room for the least size that would do, or if
 * the place is not in the region. */
static int mesher__beside(const mesher__refiner *r, mesher__candidate *c, double h,
                          delaunay_handle home)
{
    const mesher__proposal *parent = r->points + c->parent;
    double x[3], half = MESHER__CUBE / 4 * (parent->h + h);
    int i;
    for (i = 0; i < 3; i++) x[i] = parent->x[i] + (c->direction >> i & 1 ? half : -half);
    if (!mesher__in_box(r, x)) return 0;
    c->room = mesher__room_at(&r->grid, x, h / (1 - MESHER__SAME), (1 - MESHER__UNIFORM) * h);
    return c->room >= (1 - MESHER__UNIFORM) * h &&
           mesher__place(r, &c->p, x, home, parent->region);
}

/* Moves a candidate, which was placed as if it had its parent's size, to where its own size wants
 * it. Sets its state to 1 if it will do, else 0. */
static void mesher__judge(const mesher__refiner *r, mesher__candidate *c)
{
    double was = r->points[c->parent].h, h = c->p.h, change = fabs(h - was) / h;
    if (!c->p.state) return;
    c->p.state = 0;
    if (change > MESHER__UNIFORM) return;
    if (change > MESHER__SAME) {
        if (!mesher__beside(r, c, h, c->p.home)) return;
        if (c->p.h > h) c->p.h = h;
    }
    c->p.state = c->p.h <= c->room;
}

/* Places a candidate, or judges one that is placed, or both. */
static void mesher__judge_one(mesher__refiner *r, mesher__candidate *c, int place, int judge)
{
    if (place) {
        c->p.state = mesher__beside(r, c, r->points[c->parent].h, r->points[c->parent].home);
        if (!c->p.state) return;
        if (judge) c->p.h = mesher__floored(&r->field, mesher__clamp_size(r->options, c->p.h));
    }
    if (judge) mesher__judge(r, c);
}

/* Prefetches what the candidates soon after number i will read first: the background around their
 * parents. */
static void mesher__fetch_ahead(const mesher__refiner *r, const mesher__candidate *all, int i,
                                int n)
{
    enum { MESHER__AHEAD = 8 }; /* at most as many have the same parent */
    const mesher__field *field = &r->field;
    int k;
    if (i + 3 * MESHER__AHEAD < n)
        MESHER__PREFETCH(&r->points[all[i + 3 * MESHER__AHEAD].parent].home);
    if (i + 2 * MESHER__AHEAD < n)
        MESHER__PREFETCH(field->tets + r->points[all[i + 2 * MESHER__AHEAD].parent].home);
    if (i + MESHER__AHEAD < n) {
        const uint32_t *v = field->tets[r->points[all[i + MESHER__AHEAD].parent].home].v;
        for (k = 0; k < 4; k++) {
            MESHER__PREFETCH(field->vertices[v[k]].x);
            MESHER__PREFETCH(&field->vertices[v[k]].own);
        }
    }
}

/* Places or judges all candidates of a list, or both; the threads share a long one. */
static void mesher__judge_some(mesher__refiner *r, mesher__candidate *all, size_t count, int place,
                               int judge)
{
    int threads, i, n = (int)count;
    double work = 0;
    if (n < MESHER__MANY_CANDIDATES) {
        for (i = 0; i < n; i++) mesher__judge_one(r, all + i, place, judge);
        return;
    }
    threads = delaunay_crew_begin(&r->crew, 1);
    (void)threads;
    MESHER__OMP(omp parallel num_threads(threads) if(threads > 1) reduction(+ : work))
    {
        double start = delaunay_cpu_seconds();
        MESHER__OMP(omp for schedule(dynamic, 64) nowait)
        for (i = 0; i < n; i++) {
            if (place) mesher__fetch_ahead(r, all, i, n);
            mesher__judge_one(r, all + i, place, judge);
        }
        work += delaunay_cpu_seconds() - start;
    }
    delaunay_crew_end(&r->crew, work);
}

/* Places and judges the candidates of a batch. Returns how many are left in the list. */
static size_t mesher__judge_all(mesher__refiner *r, mesher__candidate *all, size_t count)
{
    size_t k, placed = 0;
    if (!mesher__has_wishes(r->options)) {
        mesher__judge_some(r, all, count, 1, 1);
        return count;
    }
    mesher__judge_some(r, all, count, 1, 0);
    for (k = 0; k < count; k++)
        if (all[k].p.state) all[placed++] = all[k];
    mesher__wish_at_points(r, &all[0].p, sizeof *all, placed);
    mesher__judge_some(r, all, placed, 0, 1);
    return placed;
}

/* Enlarges the grid if there are many more points than were expected. */
static int mesher__grid_follow(mesher__refiner *r)
{
    size_t k;
    if (r->num_points <= 256 * (r->grid.mask + 1)) return 1;
    if (!mesher__grid_reset(&r->grid, r->memory, 4 * r->num_points)) return 0;
    for (k = 0; k < r->num_points; k++)
        if (!mesher__put_in_grid(r, r->points + k)) return 0;
    return 1;
}

/* Adds all points of the lattice that grows from point p. */
static mesher_result mesher__grow_lattice(mesher__refiner *r, size_t p)
{
    const double seconds = r->options->max_seconds / 4; /* inserting them takes thrice as long */
    size_t end, k, count;
    int d, is_new;
    for (; p < r->num_points; p = end) {
        if (mesher__progress(r->options, "refine", -1)) return MESHER_CANCELLED;
        if (mesher__over_budget(r, 1) != MESHER_OK) break;
        if (seconds > 0 && delaunay_seconds(&r->options->host) - r->start > seconds) break;
        if (r->max_vertices && p > r->mesh->num_vertices &&
            p - r->mesh->num_vertices > r->max_vertices)
            break;
        if (r->options->max_tets && p > r->mesh->num_vertices + r->options->max_tets / 5) break;
        if ((double)p > (double)r->mesh->num_vertices + r->most_points) break;
        end = r->num_points - p > MESHER__FRONT ? p + MESHER__FRONT : r->num_points;
        for (count = 0, k = p; k < end; k++)
            for (d = 0; d < 8; d++) {
                mesher__candidate *c = r->front + count;
                c->node = mesher__next_node(r->nodes[k], d);
                c->parent = (uint32_t)k;
                c->direction = (uint32_t)d;
                is_new = mesher__see_node(r, c->node);
                if (is_new < 0) return mesher__no_memory(r);
                count += (size_t)is_new;
            }
        count = mesher__judge_all(r, r->front, count);
        if (!mesher__grid_follow(r)) return mesher__no_memory(r);
        for (k = 0; k < count; k++) {
            if (!r->front[k].p.state) continue;
            if (!mesher__lattice_room(r)) return mesher__no_memory(r);
            r->front[k].p.state = 0;
            r->points[r->num_points] = r->front[k].p;
            r->nodes[r->num_points++] = r->front[k].node;
            if (!mesher__put_in_grid(r, &r->front[k].p)) return mesher__no_memory(r);
        }
    }
    return MESHER_OK;
}

/* Starts a lattice at point p and lets it grow, if no other point is near. */
static mesher_result mesher__start_lattice(mesher__refiner *r, const mesher__proposal *p)
{
    size_t k = r->num_points;
    if (!mesher__is_alone(&r->grid, p->x, MESHER__ROOM_TO_START * p->h)) return MESHER_OK;
    if (!mesher__lattice_room(r)) return mesher__no_memory(r);
    r->points[k] = *p;
    r->nodes[k] = (r->num_lattices & 0x7fff) << 48 | 0x800080008000u;
    if (mesher__see_node(r, r->nodes[k]) < 0) return mesher__no_memory(r);
    r->num_points++;
    if (!mesher__put_in_grid(r, p)) return mesher__no_memory(r);
    return mesher__grow_lattice(r, k);
}

/* A place where a lattice may start: in an empty sphere that is wider than the size. */
typedef struct mesher__lattice_start {
    double          x[3], h; /* h: the size there, or 0 once another point is in the way */
    delaunay_handle tet;     /* a tetrahedron at or near x */
} mesher__lattice_start;

/* Makes room for count more starts. Returns 0 without memory. */
static int mesher__starts_room(mesher__refiner *r, size_t count)
{
    size_t n = r->num_starts;
    return mesher__room(r->memory, &r->order, &r->cap_order, n, n + count, sizeof *r->order) &&
           mesher__room(r->memory, &r->starts, &r->cap_starts, n, n + count, sizeof *r->starts);
}

/* What starts are sorted by: those with a larger ratio, of the radius of the empty sphere to the
 * size, come first; late ones come after all others. */
static uint64_t mesher__start_key(double ratio, int late)
{
    uint64_t bits;
    memcpy(&bits, &ratio, sizeof bits);
    return (~bits & (UINT64_MAX >> 1)) | (uint64_t)(late != 0) << 63;
}

/* Adds a start, for which there is room. */
static void mesher__add_start(mesher__refiner *r, const mesher__lattice_start *s, uint64_t key)
{
    size_t n = r->num_starts++;
    r->starts[n] = *s;
    r->order[n].key = key;
    r->order[n].value = n;
}

/* The least height of a tetrahedron. */
static double mesher__least_height(const double *const *p)
{
    double volume = 0, area = 0;
    int i;
    for (i = 0; i < 4; i++) {
        const double *a = p[(i + 1) & 3];
        double n[3], twice = mesher__normal(a, p[(i + 2) & 3], p[(i + 3) & 3], n);
        area = twice > area ? twice : area;
        volume = fabs(n[0] * (p[i][0] - a[0]) + n[1] * (p[i][1] - a[1]) + n[2] * (p[i][2] - a[2]));
    }
    return area > 0 ? volume / area : 0;
}

/* The starts in a batch of tetrahedra, at most two in each, and their keys. */
typedef struct mesher__batch_of_starts {
    mesher__lattice_start start[2 * MESHER__BATCH];
    uint64_t              key[2 * MESHER__BATCH];
    size_t                num;
    double                points;  /* how many points a lattice all over the batch would have */
    uint64_t              ignored; /* answers of the size function that were no size */
} mesher__batch_of_starts;

static void mesher__put_start(const mesher__refiner *r, mesher__batch_of_starts *b,
                              delaunay_handle t, const double *x, double h, uint64_t key)
{
    mesher__lattice_start *s = b->start + b->num;
    if (!mesher__in_box(r, x)) return;
    memcpy(s->x, x, sizeof s->x);
    s->h = h;
    s->tet = t;
    b->key[b->num++] = key;
}

/* Puts into the batch what tetrahedron t, of size h, offers: its circumcentre and, if it is large
 * enough, as a late start its centroid, in case something is in the way of all circumcentres. */
static void mesher__put_starts(const mesher__refiner *r, mesher__batch_of_starts *b,
                               delaunay_handle t, double h)
{
    const uint32_t *v = r->mesh->tets[t].v;
    const double *p[4];
    double x[3], radius, there = h;
    int i;
    for (i = 0; i < 4; i++) p[i] = r->mesh->vertices[v[i]].x;
    radius = sqrt(mesher__circumcentre(p[0], p[1], p[2], p[3], x));
    if (r->options->growth > 1 && !mesher__has_wishes(r->options))
        there = mesher__grown_to_centre(r, t, radius);
    if (!(radius > 1.5 * there)) return;
    mesher__put_start(r, b, t, x, there, mesher__start_key(radius / there, 0));
    if (mesher__least_height(p) < 2 * h) return;
    for (i = 0; i < 3; i++) x[i] = (p[0][i] + p[1][i] + p[2][i] + p[3][i]) / 4;
    mesher__put_start(r, b, t, x, h, mesher__start_key(radius / h, 1));
}

/* Finds the starts in the tetrahedra from first to end - 1, a batch or fewer. */
static void mesher__starts_in(const mesher__refiner *r, mesher__batch_of_starts *b,
                              delaunay_handle first, delaunay_handle end)
{
    const delaunay_mesh *mesh = r->mesh;
    double h[MESHER__BATCH], w[4];
    delaunay_handle t;
    b->num = 0;
    b->points = 0;
    b->ignored = mesher__sizes_in(r, first, end, h);
    for (t = first; t < end; t++) {
        double edge = MESHER__CUBE * h[t - first];
        if (!(edge > 0)) continue;
        mesher__weights(mesh->vertices, mesh->tets[t].v, mesh->vertices[mesh->tets[t].v[0]].x, w);
        b->points += w[0] / 3 / (edge * edge * edge);
        mesher__put_starts(r, b, t, h[t - first]);
    }
}

/* Finds the starts in all tetrahedra, some batches at a time, in the order of the tetrahedra.
 * Returns 0 without memory. */
static int mesher__start_in_tets(mesher__refiner *r, double *points)
{
    const int64_t batches = ((int64_t)r->mesh->num_tets + MESHER__BATCH - 1) / MESHER__BATCH;
    int threads = batches > 4 ? delaunay_threads(&r->options->host) : 1, k,
        some = threads > 1 ? 4 * threads : 1, enough = 1;
    mesher__batch_of_starts *batch =
        (mesher__batch_of_starts *)delaunay_alloc(r->memory, (size_t)some, sizeof *batch);
    int64_t begin;
    if (!batch) return 0;
    for (begin = 0; begin < batches && enough; begin += some) {
        const int count = batches - begin < some ? (int)(batches - begin) : some;
        /* Shared: the mesh and the field, read only; private: a batch of starts. */
        MESHER__OMP(omp parallel for schedule(dynamic, 1) num_threads(threads) if(count > 1))
        for (k = 0; k < count; k++) {
            const int64_t b = begin + k;
            delaunay_handle first = (delaunay_handle)(b * MESHER__BATCH),
                            end = b + 1 < batches ? first + MESHER__BATCH : r->mesh->num_tets;
            mesher__starts_in(r, batch + k, first ? first : 1, end);
        }
        for (k = 0; k < count && enough; k++) {
            const mesher__batch_of_starts *b = batch + k;
            size_t i;
            *points += b->points;
            r->ignored += b->ignored;
            enough = mesher__starts_room(r, b->num);
            for (i = 0; i < b->num && enough; i++) mesher__add_start(r, b->start + i, b->key[i]);
        }
    }
    delaunay_release(r->memory, batch);
    return enough;
}

/* Places for mesher__start_at. A size may go unnoticed if it is less than half of that interpolated
 * from the vertices around. A start with such a size in a source, or in a sample of a size mesh or
 * grid, comes before all others, whose points would be in its way; samples are kept for that
 * alone. */
enum { MESHER__IN_GAP, MESHER__IN_SOURCE, MESHER__IN_SAMPLE };

/* Keeps place x, if it is inside, with the size that is wanted there. *t: in, a tetrahedron to
 * search from; out, the one that contains x. Returns 0 without memory. */
static int mesher__start_at(mesher__refiner *r, const double *x, int where, delaunay_handle *t)
{
    mesher__lattice_start s;
    delaunay_handle home;
    double around;
    int found, unnoticed;
    if (!mesher__in_box(r, x)) return 1;
    *t = home = delaunay_locate(r->mesh, x, *t);
    if (!home || !mesher__is_inside(r->mesh, home)) return 1;
    memcpy(s.x, x, sizeof s.x);
    s.h = around = mesher__size_at(&r->field, x, &home, &found);
    r->ignored += mesher__wishes(r->options, 1, x, r->mesh->color + *t, &s.h);
    s.h = mesher__floored(&r->field, s.h);
    s.tet = *t;
    unnoticed = where != MESHER__IN_GAP && around > 2 * s.h;
    if (where == MESHER__IN_SAMPLE && !unnoticed) return 1;
    if (!mesher__starts_room(r, 1)) return 0;
    mesher__add_start(r, &s, mesher__start_key(unnoticed ? HUGE_VAL : 1.5, 0));
    r->num_unnoticed += (size_t)unnoticed;
    return 1;
}

enum {
    MESHER__SOURCES = 10000,     /* in sources beyond this number no places are kept; about so many
                                    places of a size mesh or grid are looked at */
    MESHER__WIDE_SOURCES = 1000, /* if there are more, places 3 and up are left out */
    MESHER__PLACES = 11
};

/* A place in a source. 0: its middle, which may be on the surface; 1 and 2: the ends of a segment;
 * from 3 on: about half way from its middle to its border, in eight directions. */
static void mesher__source_place(const mesher_source *source, int place, double *x)
{
    const double *a = source->xyz;
    int k, is_box = source->shape == MESHER_SHAPE_BOX;
    for (k = 0; k < 3; k++) {
        double away = is_box ? (a[3 + k] - a[k]) / 4 : 0.3 * source->radius;
        switch (source->shape) {
        case MESHER_SHAPE_BALL: x[k] = a[k]; break;
        case MESHER_SHAPE_TRIANGLE: x[k] = (a[k] + a[3 + k] + a[6 + k]) / 3; break;
        default: x[k] = place == 1 || place == 2 ? a[3 * (place - 1) + k] : (a[k] + a[3 + k]) / 2;
        }
        if (place > 2) x[k] += (place - 3) >> k & 1 ? away : -away;
    }
}

/* Keeps places in the sources, which come after all others that are not late, or before them. A
 * source with a steep gradation, none of whose surrounding tetrahedra has a corner near it, would
 * not be noticed otherwise. Returns 0 without memory. */
static int mesher__start_at_sources(mesher__refiner *r)
{
    const mesher_options *o = r->options;
    const size_t most =
        o->num_sources < MESHER__SOURCES ? o->num_sources : (size_t)MESHER__SOURCES;
    delaunay_handle t = 0;
    double x[3];
    size_t i;
    int place, places = most > MESHER__WIDE_SOURCES ? 3 : MESHER__PLACES, kept = 1;
    for (i = 0; i < most && kept; i++)
        for (place = 0; place < places && kept; place++) {
            if ((place == 1 || place == 2) && o->sources[i].shape != MESHER_SHAPE_SEGMENT) continue;
            mesher__source_place(o->sources + i, place, x);
            kept = mesher__start_at(r, x, MESHER__IN_SOURCE, &t);
        }
    return kept;
}

/* Keeps those of MESHER__SOURCES places, spread over the size mesh, and as many over the size grid,
 * whose sizes would not be noticed otherwise. Returns 0 without memory. */
static int mesher__start_at_samples(mesher__refiner *r)
{
    const mesher_size_mesh *mesh = r->options->size_mesh;
    const mesher_size_grid *grid = r->options->size_grid;
    const size_t tets = mesh ? mesh->num_tets : 0,
                 nodes = grid ? (size_t)grid->count[0] * grid->count[1] * grid->count[2] : 0;
    delaunay_handle t = 0;
    double x[3];
    size_t i;
    int k, kept = 1;
    for (i = 0; i < tets && kept; i += 1 + tets / MESHER__SOURCES) {
        const mesher__size_tree *tree = (const mesher__size_tree *)mesh->tree;
        const uint32_t *v = mesh->tets + 4 * (size_t)tree->order[i];
        mesher__centroid_of(mesh->xyz, v, 4, x);
        kept = mesher__start_at(r, x, MESHER__IN_SAMPLE, &t);
    }
    for (i = 0; i < nodes && kept; i += 1 + nodes / MESHER__SOURCES) {
        size_t node = i;
        for (k = 0; k < 3; k++) {
            x[k] = grid->origin[k] + grid->spacing[k] * (double)(node % grid->count[k]);
            node /= grid->count[k];
        }
        kept = mesher__start_at(r, x, MESHER__IN_SAMPLE, &t);
    }
    return kept;
}

/* Keeps places half way between facets that face each other, if these are larger than the size that
 * is wanted between them: there are no circumcentres there. Returns 0 without memory. */
static int mesher__start_in_gaps(mesher__refiner *r)
{
    const delaunay_mesh *mesh = r->mesh;
    delaunay_handle t, met, home;
    double n[3], x[3], gap;
    int i, j, k, kept = 1;
    for (t = 1; t < mesh->num_tets && r->options->layers > 0 && kept; t++)
        for (i = 0; i < 4 && mesher__is_inside(mesh, t) && kept; i++) {
            gap = mesher__gap(mesh, t, i, n, x, &met, &j);
            if (!(gap > 0 && gap < r->options->layers * mesher__facet_extent(mesh, t, i))) continue;
            for (k = 0; k < 3; k++) x[k] += gap / 2 * n[k];
            home = t;
            kept = mesher__start_at(r, x, MESHER__IN_GAP, &home);
        }
    return kept;
}

/* Finds all places where lattices may start, and sorts them: after those that would not be noticed
 * otherwise, the widest sphere, relative to the size, comes first. *points: how many points a
 * lattice all over the inside would have. Returns 0 without memory. */
static int mesher__find_starts(mesher__refiner *r, double *points)
{
    *points = 0;
    r->num_unnoticed = 0;
    if (!r->memory->limit_bytes) /* often half of the tetrahedra have one */
        (void)mesher__starts_room(r, r->mesh->num_tets / 2);
    return mesher__start_in_tets(r, points) && mesher__start_at_sources(r) &&
           mesher__start_at_samples(r) && mesher__start_in_gaps(r) &&
           mesher__sort(r->domain, r->order, r->num_starts) == MESHER_OK;
}

/* Frees what only lattices need. */
static void mesher__lattice_free(mesher__refiner *r)
{
    delaunay_release(r->memory, r->nodes);
    delaunay_release(r->memory, r->seen);
    delaunay_release(r->memory, r->front);
    delaunay_release(r->memory, r->starts);
    mesher__grid_free(&r->grid, r->memory);
    r->nodes = NULL;
    r->seen = NULL;
    r->front = NULL;
    r->starts = NULL;
    r->cap_nodes = r->num_seen = r->cap_seen = r->cap_front = r->num_starts = r->cap_starts = 0;
}

/* Makes room for a lattice of about the expected number of points, and for the mesh that results,
 * at once rather than in steps, each of which copies. If there is no memory for that, the steps
 * will do. The sweeps add two points per vertex of the surface, or fewer; a vertex inside has about
 * seven tetrahedra. */
static void mesher__foresee(mesher__refiner *r, double expected)
{
    size_t n = r->mesh->num_vertices + 1024, points = (size_t)(1.1 * expected) + n,
           more = points + n, vertices = r->mesh->num_vertices + more,
           tets = r->mesh->num_tets + 7 * more;
    if (vertices >= UINT32_MAX / 2 || tets >= ((delaunay_handle)-1) / 4 || r->memory->limit_bytes)
        return;
    if (points > r->cap_points)
        (void)mesher__grow(r->memory, &r->points, &r->cap_points, 0, points, sizeof *r->points);
    if (points > r->cap_nodes)
        (void)mesher__grow(r->memory, &r->nodes, &r->cap_nodes, 0, points, sizeof *r->nodes);
    (void)delaunay_reserve(r->mesh, vertices, tets);
}

/* Have the points left room for a lattice at this start? */
static int mesher__has_room(const mesher__refiner *r, const mesher__lattice_start *s)
{
    return s->h > 0 && mesher__is_alone(&r->grid, s->x, s->h) &&
           mesher__is_alone(&r->grid, s->x, MESHER__ROOM_TO_START * s->h);
}

/* Drops the starts that by now have a point in their way; the threads share them. It goes in the
 * order of the mesh, in which one start reads the same part of the grid as the next. */
static void mesher__thin_starts(mesher__refiner *r)
{
    int64_t k, n = (int64_t)r->num_starts;
    int threads = delaunay_threads(&r->options->host);
    (void)threads;
    /* Shared: all, read only, but for the starts, each of one thread. */
    MESHER__OMP(omp parallel for schedule(dynamic, 1024) num_threads(threads) if(n > 4096))
    for (k = 0; k < n; k++)
        if (!mesher__has_room(r, r->starts + k)) r->starts[k].h = 0;
}

/* Drops those of the starts begin to end of the order that have a point in their way. */
static void mesher__thin_next(mesher__refiner *r, size_t begin, size_t end)
{
    int64_t k;
    int threads = delaunay_threads(&r->options->host);
    (void)threads;
    /* Shared: all, read only, but for the starts, each of one thread. */
    MESHER__OMP(omp parallel for schedule(dynamic, 64) num_threads(threads))
    for (k = (int64_t)begin; k < (int64_t)end; k++) {
        mesher__lattice_start *s = r->starts + r->order[k].value;
        if (k + 8 < (int64_t)end) MESHER__PREFETCH(r->starts + r->order[k + 8].value);
        if (!mesher__has_room(r, s)) s->h = 0;
    }
}

/* Makes the lattices of all starts, in their order. */
static mesher_result mesher__lattices(mesher__refiner *r)
{
    enum { MESHER__NEXT = 4096 };
    mesher_result result = MESHER_OK;
    size_t k, thinned = r->num_points, before; /* at first most have room */
    for (k = 0; k < r->num_starts && result == MESHER_OK; k++) {
        mesher__lattice_start *s = r->starts + r->order[k].value;
        int late = r->order[k].key >> 63 != 0;
        delaunay_handle met;
        mesher__proposal p;
        if (k + 16 < r->num_starts) MESHER__PREFETCH(r->starts + r->order[k + 16].value);
        if (k % 256 == 0 && r->num_points > thinned + thinned / 8) {
            mesher__thin_starts(r);
            thinned = r->num_points;
        }
        if (k && k % MESHER__NEXT == 0)
            mesher__thin_next(r, k, k + MESHER__NEXT < r->num_starts ? k + MESHER__NEXT
                                                                     : r->num_starts);
        if (k % 256 == 0 && mesher__over_budget(r, 1) != MESHER_OK) break;
        if (late && r->num_lattices > 0) break;
        if (!mesher__has_room(r, s)) continue;
        if (!mesher__see(r->mesh, s->x, s->tet, &met)) continue;
        if (!mesher__place(r, &p, s->x, s->tet, r->mesh->color[s->tet])) continue;
        r->ignored += mesher__wishes(r->options, 1, s->x, &p.region, &p.h);
        p.h = mesher__floored(&r->field, p.h);
        before = r->num_points;
        result = mesher__start_lattice(r, &p);
        r->num_lattices += r->num_points > before;
    }
    return result;
}

/* The given number of lattice points, or about as many as the budgets allow if that is less: making
 * room for points that never come would cost time. A second makes a million or two. */
static double mesher__within_budgets(const mesher__refiner *r, double points)
{
    const mesher_options *o = r->options;
    const double some = 1024 + (double)r->mesh->num_vertices;
    double most = points;
    if (o->max_vertices && (double)o->max_vertices + some < most)
        most = (double)o->max_vertices + some;
    if (o->max_tets && (double)o->max_tets / 5 + some < most)
        most = (double)o->max_tets / 5 + some;
    if (o->max_seconds > 0 && 2e6 * o->max_seconds + some < most)
        most = 2e6 * o->max_seconds + some;
    return most < r->most_points ? most : r->most_points;
}

/* The mean of 1 / h^3 in a tetrahedron in which h is linear, and has these values at the corners:
 * six times the divided difference of a function whose third derivative that is, log(h) / 2
 * (Hermite and Genocchi). Corners of nearly the same size are taken to differ by a thousandth. */
static double mesher__mean_density(const double *sizes)
{
    double h[4], f[4];
    int i, k;
    for (i = 0; i < 4; i++) {
        for (k = i; k > 0 && h[k - 1] > sizes[i]; k--) h[k] = h[k - 1];
        h[k] = sizes[i];
    }
    for (i = 0; i < 4; i++) {
        if (i > 0 && h[i] < 1.001 * h[i - 1]) h[i] = 1.001 * h[i - 1];
        f[i] = log(h[i] / h[0]) / 2;
    }
    for (k = 1; k < 4; k++)
        for (i = 3; i >= k; i--) f[i] = (f[i] - f[i - 1]) / (h[i] - h[i - k]);
    return 6 * f[3];
}

/* About how many tetrahedra the sizes at the vertices ask for, interpolated between them; exact: 0:
 * an upper bound, which is quick to compute. */
static double mesher__interpolated_tets(const mesher_domain *domain, int exact)
{
    const delaunay_mesh *mesh = &domain->mesh;
    const double lowest = mesher__size_floor(mesh), cap = mesher__size_cap(&domain->options),
                 low_density = 1 / (cap * cap * cap);
    double sum = 0, h[4], density;
    delaunay_handle t;
    int i;
    for (t = 1; t < mesh->num_tets; t++) {
        const uint32_t *v = mesh->tets[t].v;
        double least = cap;
        int sized = mesher__is_inside(mesh, t);
        for (i = 0; i < 4 && sized; i++) {
            h[i] = domain->own_size[v[i]];
            sized = h[i] > 0;
            if (h[i] < lowest) h[i] = lowest;
            if (h[i] < least) least = h[i];
        }
        if (!sized) continue;
        density = exact ? mesher__mean_density(h) : 1 / (least * least * least);
        sum += mesher__tet_volume(mesh, t) * (density < low_density ? low_density : density);
    }
    return 12 * sum / (MESHER__CUBE * MESHER__CUBE * MESHER__CUBE);
}

/* Warns the host that the sizes ask for this many tetrahedra, far more than there will be time or
 * memory for: sizes in the wrong unit, or tiny sizes interpolated across a large gap. */
static void mesher__warn_of_many(const mesher__refiner *r, double tets)
{
    const mesher_options *o = r->options;
    const delaunay_host *host = &o->host;
    const int asked = o->size > 0 || o->growth > 1 || mesher__has_wishes(o);
    char text[160];
    if (!host->log) return;
    snprintf(text, sizeof text, "refine: the sizes ask for about %.0e tetrahedra%s", tets,
             asked ? "" : "; with growth 1.3, they become larger inside");
    host->log(host->user, DELAUNAY_LOG_WARNING, text);
}

/* The same if it is the interpolation that asks for so many, away from lattices. (With growth,
 * sizes inside are larger than that.) */
static void mesher__warn_if_steep(const mesher__refiner *r)
{
    double tets;
    if (!r->options->host.log || r->domain->num_own_sizes != r->mesh->num_vertices ||
        r->options->growth > 1 ||
        mesher__interpolated_tets(r->domain, 0) < 7 * MESHER__LATTICE_MOST)
        return;
    tets = mesher__interpolated_tets(r->domain, 1);
    if (tets > 7 * MESHER__LATTICE_MOST) mesher__warn_of_many(r, tets);
}

/* The largest size that may be wanted in a tetrahedron. */
static double mesher__largest_size(const mesher_domain *domain, const uint32_t *v)
{
    const mesher_options *o = &domain->options;
    const delaunay_vertex *x = domain->mesh.vertices;
    const int has_own = domain->num_own_sizes == domain->mesh.num_vertices;
    const double cap = mesher__size_cap(o);
    double most = 0, way = 0, d;
    int i;
    for (i = 0; i < 4; i++) {
        most = domain->size[v[i]] > most ? domain->size[v[i]] : most;
        if (has_own) most = domain->own_size[v[i]] > most ? domain->own_size[v[i]] : most;
        d = mesher__distance(x[v[0]].x, x[v[i]].x);
        way = d > way ? d : way;
    }
    if (!(most > 0)) return HUGE_VAL; /* no corner has a size */
    if (o->growth > 1) most += 2 * (o->growth - 1) * way;
    if (most > cap) most = cap;
    return o->min_size > most ? o->min_size : most;
}

/* How many tetrahedra the sizes ask for before refinement: as many as on lattices of the largest
 * sizes. */
static double mesher__asked_tets(const mesher_domain *domain)
{
    const delaunay_mesh *mesh = &domain->mesh;
    const double least = mesher__size_floor(mesh);
    double points = 0, w[4];
    delaunay_handle t;
    for (t = 1; t < mesh->num_tets; t++) {
        const uint32_t *v = mesh->tets[t].v;
        double edge;
        if (!mesher__is_inside(mesh, t)) continue;
        edge = mesher__largest_size(domain, v);
        edge = MESHER__CUBE * (edge > least ? edge : least);
        mesher__weights(mesh->vertices, v, mesh->vertices[v[0]].x, w);
        points += w[0] / 3 / (edge * edge * edge);
    }
    return 6 * points;
}

/* Are there numbers for half of the tetrahedra that the sizes ask for? If not, the report says so.
 * It does not matter if there is a budget, which ends the work. */
static int mesher__has_numbers(const mesher_domain *domain, const char *stage,
                               mesher_report *report)
{
    const mesher_options *o = &domain->options;
    const double most = (double)((delaunay_handle)-1 / 4);
    double asked;
    if (o->max_vertices || o->max_tets || o->max_seconds > 0 || o->host.memory_limit_bytes)
        return 1;
    asked = mesher__asked_tets(domain);
    if (asked / 12 < UINT32_MAX && asked / 2 < most) return 1;
    if (report)
        snprintf(report->message, sizeof report->message,
                 "%s: the sizes ask for about %.0e tetrahedra, and there are numbers for %.0e: "
                 "make them larger, or set a budget", stage, asked, most);
    return 0;
}

/* Makes the points of body-centred lattices all over the inside, away from the surface, wherever
 * the size is nearly uniform: their Delaunay tetrahedra are all alike and good, and need no trials.
 */
static mesher_result mesher__lattice(mesher__refiner *r, mesher_report *report)
{
    double points;
    size_t first;
    mesher_result result;
    r->num_points = 0;
    r->most_points = mesher__memory_for(r);
    if (!mesher__find_starts(r, &points)) return mesher__no_memory(r);
    if (!(points > MESHER__LATTICE_MOST)) mesher__warn_if_steep(r);
    if ((!(points >= MESHER__LATTICE_LEAST) && r->num_unnoticed == 0) ||
        points > MESHER__LATTICE_MOST) {
        result = MESHER_OK;
        if (points > MESHER__LATTICE_MOST) {
            mesher__warn_of_many(r, 7 * points);
            if (!mesher__has_numbers(r->domain, "refine", report)) result = MESHER_ERROR_TOO_LARGE;
        }
        mesher__lattice_free(r);
        return result;
    }
    points = mesher__within_budgets(r, points);
    if (!mesher__grid_reset(&r->grid, r->memory, (size_t)points + r->mesh->num_vertices))
        return mesher__no_memory(r);
    mesher__foresee(r, points);
    if (!mesher__put_vertices(r)) return mesher__no_memory(r);
    if (!mesher__room(r->memory, &r->front, &r->cap_front, 0, 8 * MESHER__FRONT, sizeof *r->front))
        return mesher__no_memory(r);
    first = r->num_points;
    result = mesher__lattices(r);
    if (r->num_points > first)
        memmove(r->points, r->points + first, (r->num_points - first) * sizeof *r->points);
    r->num_points -= first;
    mesher__lattice_free(r);
    return result;
}

/* ---- >>insert  points filtered, then inserted --------------------------------------------- */

/* -- the filter */

/* What is in the way of a point. */
enum { MESHER__FREE, MESHER__NEAR_CORNER, MESHER__NEAR_POINT };

static int mesher__in_the_way(const mesher__refiner *r, const mesher__proposal *p)
{
    if (mesher__has_wishes(r->options) && !mesher__is_clear(r, p, p->h, p->tet))
        return MESHER__NEAR_CORNER;
    return mesher__is_alone(&r->grid, p->x, p->h) ? MESHER__FREE : MESHER__NEAR_POINT;
}

/* Prefetches what mesher__filter will soon read about p. */
static void mesher__await(const mesher__refiner *r, const mesher__proposal *p)
{
    const mesher__grid *g = &r->grid;
    size_t cell = mesher__grid_cell(g, mesher__level(p->h), p->x);
    MESHER__PREFETCH(g->used + (cell >> 6));
    MESHER__PREFETCH(g->cells + cell);
    MESHER__PREFETCH(r->mesh->flags + p->source);
}

/* Keeps a maximal set of points that are far enough from each other. A tetrahedron whose point is
 * too near to another one is asked again later. */
static int mesher__filter(mesher__refiner *r)
{
    size_t n = r->num_points, k, kept = 0;
    if (!mesher__grid_reset(&r->grid, r->memory, n)) return 0;
    for (k = 0; k < n; k++) {
        uint32_t i = (uint32_t)r->order[k].value;
        const mesher__proposal *p = r->points + i;
        int obstacle;
        if (k + 12 < n) mesher__await(r, r->points + r->order[k + 12].value);
        obstacle = mesher__in_the_way(r, p);
        if (obstacle == MESHER__FREE) {
            r->order[kept++].value = i;
            if (!mesher__put_in_grid(r, p)) return 0;
        } else if (obstacle == MESHER__NEAR_CORNER) {
            r->mesh->flags[p->source] |= MESHER__SEEN;
        } else {
            mesher__lose(r->mesh, p->source);
        }
    }
    r->num_points = kept;
    return 1;
}

/* -- insertion */

/* delaunay_insphere_perturbed(...) > 0, its filter inlined (the same bound: 1e-28 times the tenth
 * power of the largest distance). */
static inline int mesher__in_sphere(const delaunay_vertex *vertices, const uint32_t *v,
                                    const double *p)
{
    const double *a = vertices[v[0]].x, *b = vertices[v[1]].x, *c = vertices[v[2]].x,
                 *d = vertices[v[3]].x;
    double ax = a[0] - p[0], ay = a[1] - p[1], az = a[2] - p[2];
    double bx = b[0] - p[0], by = b[1] - p[1], bz = b[2] - p[2];
    double cx = c[0] - p[0], cy = c[1] - p[1], cz = c[2] - p[2];
    double dx = d[0] - p[0], dy = d[1] - p[1], dz = d[2] - p[2];
    double ab = ax * by - bx * ay, bc = bx * cy - cx * by, cd = cx * dy - dx * cy;
    double da = dx * ay - ax * dy, ac = ax * cy - cx * ay, bd = bx * dy - dx * by;
    double al = ax * ax + ay * ay + az * az, bl = bx * bx + by * by + bz * bz;
    double cl = cx * cx + cy * cy + cz * cz, dl = dx * dx + dy * dy + dz * dz;
    double det = cl * (dz * ab + az * bd + bz * da) - dl * (az * bc - bz * ac + cz * ab) +
                 (al * (bz * cd - cz * bd + dz * bc) - bl * (cz * da + dz * ac + az * cd));
    double l = al > bl ? al : bl, m = cl > dl ? cl : dl;
    l = l > m ? l : m;
    if (det * det > 1e-28 * (l * l * l * l * l) + 1e-290) return det > 0;
    return delaunay_insphere_perturbed(a, b, c, d, p) > 0;
}

#ifdef MESHER__SIMD
/* The filter of mesher__in_sphere for four tetrahedra. Returns bits of those whose spheres contain
 * p; *unsure: bits of those that it cannot decide. */
__attribute__((target("avx2"))) static inline int
mesher__in_spheres4(const delaunay_vertex *vertices, const uint32_t *v0, const uint32_t *v1,
                    const uint32_t *v2, const uint32_t *v3, const double *p, int *unsure)
{
    __m256d px = _mm256_set1_pd(p[0]), py = _mm256_set1_pd(p[1]), pz = _mm256_set1_pd(p[2]);
    __m256d ax, ay, az, al, bx, by, bz, bl, cx, cy, cz, cl, dx, dy, dz, dl, ab, bc, cd, da, ac, bd,
        det, l, e;
    MESHER__LOAD(0, ax, ay, az, al);
    MESHER__LOAD(1, bx, by, bz, bl);
    MESHER__LOAD(2, cx, cy, cz, cl);
    MESHER__LOAD(3, dx, dy, dz, dl);
    ab = MESHER__CROSS(ax, by, bx, ay);
    bc = MESHER__CROSS(bx, cy, cx, by);
    cd = MESHER__CROSS(cx, dy, dx, cy);
    da = MESHER__CROSS(dx, ay, ax, dy);
    ac = MESHER__CROSS(ax, cy, cx, ay);
    bd = MESHER__CROSS(bx, dy, dx, by);
    e = _mm256_add_pd(_mm256_add_pd(_mm256_mul_pd(dz, ab), _mm256_mul_pd(az, bd)),
                      _mm256_mul_pd(bz, da));
    det = _mm256_mul_pd(cl, e);
    e = _mm256_add_pd(MESHER__CROSS(az, bc, bz, ac), _mm256_mul_pd(cz, ab));
    det = _mm256_sub_pd(det, _mm256_mul_pd(dl, e));
    e = _mm256_add_pd(MESHER__CROSS(bz, cd, cz, bd), _mm256_mul_pd(dz, bc));
    l = _mm256_mul_pd(al, e);
    e = _mm256_add_pd(_mm256_add_pd(_mm256_mul_pd(cz, da), _mm256_mul_pd(dz, ac)),
                      _mm256_mul_pd(az, cd));
    det = _mm256_add_pd(det, _mm256_sub_pd(l, _mm256_mul_pd(bl, e)));
    l = _mm256_max_pd(_mm256_max_pd(al, bl), _mm256_max_pd(cl, dl));
    e = _mm256_mul_pd(l, l);
    e = _mm256_mul_pd(_mm256_mul_pd(e, e), _mm256_mul_pd(l, _mm256_set1_pd(1e-28)));
    e = _mm256_add_pd(e, _mm256_set1_pd(1e-290));
    *unsure = _mm256_movemask_pd(_mm256_cmp_pd(_mm256_mul_pd(det, det), e, _CMP_NGT_UQ));
    return _mm256_movemask_pd(_mm256_cmp_pd(det, _mm256_setzero_pd(), _CMP_GT_OQ));
}

/* The same for the tetrahedra of count facet handles; their list is filled up to full fours. */
__attribute__((target("avx2"))) static unsigned
mesher__in_spheres_avx2(const delaunay_vertex *vertices, const delaunay_tet *tets,
                        const delaunay_handle *q, unsigned count, const double *p,
                        unsigned *unsure)
{
    unsigned k, in = 0, open = 0;
    for (k = 0; k < count; k += 4) {
        int left;
        in |= (unsigned)mesher__in_spheres4(vertices, tets[q[k] >> 2].v, tets[q[k + 1] >> 2].v,
                                            tets[q[k + 2] >> 2].v, tets[q[k + 3] >> 2].v, p, &left)
              << k;
        open |= (unsigned)left << k;
    }
    *unsure = open & ((1u << count) - 1);
    return in & ((1u << count) - 1);
}
#endif

/* delaunay_orient3d(p, a, b, c) > 0, its filter inlined. */
static inline int mesher__sees(const double *p, const double *a, const double *b, const double *c)
{
    double ax = a[0] - p[0], ay = a[1] - p[1], az = a[2] - p[2];
    double bx = b[0] - p[0], by = b[1] - p[1], bz = b[2] - p[2];
    double cx = c[0] - p[0], cy = c[1] - p[1], cz = c[2] - p[2];
    double det = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx);
    double la = ax * ax + ay * ay + az * az, lb = bx * bx + by * by + bz * bz,
           lc = cx * cx + cy * cy + cz * cz;
    if (det * det > 2e-30 * la * lb * lc + 1e-290) return det > 0;
    return delaunay_orient3d(p, a, b, c) > 0;
}

/* What became of a point. LATER: it needs another section or more memory, and nothing has been
 * changed. */
enum {
    MESHER__NO_MEMORY = -1,
    MESHER__GIVEN_UP = 0,
    MESHER__DONE = 1,
    MESHER__LATER = 2,
    MESHER__GENERAL = 3 /* nothing yet: the quick way (a plain cavity) does not suffice */
};

/* Is vertex v in this thread's section, or does one thread insert alone? */
static inline int mesher__is_mine(const mesher__cavity *c, const delaunay_mesh *mesh, uint32_t v)
{
    return !c->shared || mesh->vertices[v].key == c->section;
}

enum { MESHER__BLOCKED = 3 }; /* a walk goes round so many facets at most */

/* Walks, by exact signs, to a tetrahedron that contains x or has it on its boundary. It goes round
 * a facet behind which the section ends. Returns 0 if the walk leaves the mesh, cycles, or does not
 * get on in the section (then *later is set). c->nearby is the last tetrahedron that it reached. */
static delaunay_handle mesher__walk(mesher__cavity *c, const delaunay_mesh *mesh, const double *x,
                                    delaunay_handle t, int *later)
{
    delaunay_handle from = 0;
    uint32_t turn = 0;
    int step, i, k, blocked = 0, before;
    for (step = 0; step < MESHER__WALK_STEPS; step++) {
        const delaunay_tet *tet = mesh->tets + t;
        if (tet->v[3] == DELAUNAY_GHOST) return 0;
        c->nearby = t;
        turn = turn * 1664525u + 1013904223u;
        for (before = blocked, i = 0, k = 0; k < 4; k++) {
            const uint8_t *f;
            delaunay_handle n;
            i = (int)((turn >> 30) + (uint32_t)k) & 3;
            f = delaunay_facet_order(i);
            n = tet->n[i];
            if ((n && n >> 2 == from) ||
                !mesher__sees(x, mesh->vertices[tet->v[f[0]]].x, mesh->vertices[tet->v[f[2]]].x,
                              mesh->vertices[tet->v[f[1]]].x))
                continue;
            if (!n) return 0;
            if (mesher__is_mine(c, mesh, mesh->tets[n >> 2].v[n & 3])) break;
            blocked++;
        }
        if (k == 4 && blocked == before) return t;
        *later = k == 4 || blocked > MESHER__BLOCKED;
        if (*later) return 0;
        from = t;
        t = tet->n[i] >> 2;
    }
    return 0;
}

enum { MESHER__IN = 1, MESHER__OUT = 2 }; /* delaunay_mesh.mark while a cavity is dug */

/* Makes room for the given numbers of tetrahedra (and their vertices) and of facets. Returns 0
 * without memory, or if it may not allocate. */
static int mesher__cavity_room(mesher__cavity *c, size_t tets, size_t facets)
{
    const size_t keep = c->cap_search;
    int i;
    if (tets > c->cap_tets || c->cap_tets + 3 > c->cap_vertices || facets > keep) {
        delaunay_handle **lists[3];
        lists[0] = &c->queue;
        lists[1] = &c->border;
        lists[2] = &c->slots;
        if (c->shared) return 0;
        if (!mesher__room(c->memory, &c->tets, &c->cap_tets, c->num_tets, tets, sizeof *c->tets) ||
            !mesher__room(c->memory, &c->vertices, &c->cap_vertices, 0, c->cap_tets + 3,
                          sizeof *c->vertices))
            return 0;
        for (i = 0; i < 3; i++) {
            c->cap_search = keep;
            if (!mesher__room(c->memory, lists[i], &c->cap_search, keep, facets, sizeof **lists[i]))
                return 0;
        }
    }
    return 1;
}

/* The state of a breadth-first search for a cavity. It is kept apart from the mesh: marks are
 * bytes, and the compiler must assume that writing one may change anything in memory. */
typedef struct mesher__search {
    const delaunay_tet *tets;
    const delaunay_vertex *vertices;
    const uint16_t *flags;
    uint8_t *mark;
    delaunay_handle *in; /* facets by which those in the cavity were reached; 4t+0 of the first */
    delaunay_handle *queue; /* the cavity's */
    uint32_t num_in, num_queue;
    uint32_t expanded; /* entries of `in` before this one have been expanded */
    uint32_t done;     /* entries of the queue before this one have been tested */
    const double *p;
    int shared, simd;
    uint32_t section;
} mesher__search;

enum {
    MESHER__TESTS = 12,        /* tests at a time, in fours that do not depend on each other */
    MESHER__SEARCH_SLACK = 128 /* what the lists grow by at most from one batch to the next */
};

/* Queues the neighbours of the tetrahedra that have come in, but not those beyond constrained
 * facets. Without branches, as they would be unpredictable. */
static inline void mesher__expand(mesher__search *s)
{
    const delaunay_tet *tets = s->tets;
    delaunay_handle *queue = s->queue;
    uint8_t *mark = s->mark;
    uint32_t num_queue = s->num_queue, k = s->expanded, end = s->num_in, i;
    for (; k < end; k++) {
        const delaunay_handle t = s->in[k] >> 2, *next = tets[t].n;
        const unsigned shut = s->flags[t];
        for (i = 0; i < 4; i++) {
            delaunay_handle n = next[i];
            uint8_t seen = MESHER__FETCH(&mark[n >> 2]); /* all threads write mark[0] */
            unsigned fresh = !seen & (n != 0) & ((shut & DELAUNAY_FACET_BIT(i)) == 0);
            queue[num_queue] = n;
            num_queue += fresh;
            MESHER__STORE(&mark[n >> 2], (uint8_t)(fresh ? (unsigned)MESHER__OUT : seen));
            MESHER__PREFETCH(tets + (n >> 2));
        }
    }
    s->expanded = end;
    s->num_queue = num_queue;
}

/* Bits of those of the next count tetrahedra of the queue whose circumspheres contain p. */
static inline unsigned mesher__in_spheres(mesher__search *s, unsigned count)
{
    const delaunay_handle *q = s->queue + s->done;
    unsigned in = 0, unsure = (1u << count) - 1, k;
#ifdef MESHER__SIMD
    if (s->simd) {
        for (k = 0; k < 3; k++) s->queue[s->num_queue + k] = q[0]; /* fours are filled up */
        in = mesher__in_spheres_avx2(s->vertices, s->tets, q, count, s->p, &unsure);
    }
#endif
    for (k = 0; unsure; k++, unsure >>= 1) {
        if (!(unsure & 1)) continue;
        in &= ~(1u << k);
        in |= (unsigned)mesher__in_sphere(s->vertices, s->tets[q[k] >> 2].v, s->p) << k;
    }
    return in;
}

/* Tests the next count tetrahedra of the queue. Returns LATER if one of them belongs to the cavity
 * but not to the section. */
static inline int mesher__test(mesher__search *s, unsigned count)
{
    const delaunay_handle *q = s->queue + s->done;
    const delaunay_tet *tets = s->tets;
    uint32_t num_in = s->num_in;
    unsigned in = mesher__in_spheres(s, count), ghosts = 0, foreign = 0, i;
    for (i = 0; i < count; i++)
        ghosts |= (unsigned)(tets[q[i] >> 2].v[3] == DELAUNAY_GHOST) << i;
    in &= ~ghosts;
    for (i = 0; s->shared && i < count; i++) {
        uint32_t apex = tets[q[i] >> 2].v[q[i] & 3];
        foreign |= (unsigned)(s->vertices[apex].key != s->section) << i;
    }
    if (in & foreign) return MESHER__LATER;
    for (i = 0; i < count; i++) {
        unsigned inside = in >> i & 1;
        delaunay_handle h = q[i];
        s->mark[h >> 2] = (uint8_t)(MESHER__OUT - inside);
        s->in[num_in] = h;
        num_in += inside;
    }
    s->num_in = num_in;
    s->done += count;
    return MESHER__DONE;
}

/* Fills the lists of a cavity from the facets by which its tetrahedra were reached: each
 * tetrahedron brings a vertex, and the first one four. */
static void mesher__take_reached(mesher__cavity *c, const delaunay_tet *tets,
                                 const delaunay_handle *in, uint32_t num_in)
{
    uint32_t k;
    for (k = 0; k < 3; k++) c->vertices[k] = tets[in[0] >> 2].v[k + 1];
    for (k = 0; k < num_in; k++) {
        delaunay_handle h = in[k];
        c->vertices[k + 3] = tets[h >> 2].v[h & 3];
        c->tets[k] = h >> 2;
    }
    c->num_tets = num_in;
    c->whole = 1;
}

static void mesher__point_search(mesher__search *s, const mesher__cavity *c)
{
    s->in = c->tets;
    s->queue = c->queue;
}

/* Finds all tetrahedra whose circumspheres contain p and that can be reached through each other
 * from t without crossing a constrained facet. */
static int mesher__dig(mesher__cavity *c, delaunay_mesh *mesh, const double *p, delaunay_handle t)
{
    mesher__search s;
    int state = MESHER__DONE;
    c->num_tets = c->num_queue = 0;
    if (!mesher__cavity_room(c, MESHER__SEARCH_SLACK, MESHER__SEARCH_SLACK))
        return MESHER__NO_MEMORY;
    memset(&s, 0, sizeof s);
    mesher__point_search(&s, c);
    s.tets = mesh->tets;
    s.vertices = mesh->vertices;
    s.flags = mesh->flags;
    s.mark = mesh->mark;
    s.p = p;
    s.shared = c->shared;
    s.simd = c->simd;
    s.section = c->section;
    s.in[s.num_in++] = 4 * t;
    s.mark[t] = MESHER__IN;
    for (;;) {
        uint32_t left;
        c->num_tets = s.num_in;
        c->num_queue = s.num_queue;
        if (s.num_in + MESHER__SEARCH_SLACK > c->cap_tets ||
            s.num_queue + MESHER__SEARCH_SLACK > c->cap_search) {
            if (!mesher__cavity_room(c, s.num_in + MESHER__SEARCH_SLACK,
                                     s.num_queue + MESHER__SEARCH_SLACK)) {
                c->tets[0] = t;
                return MESHER__NO_MEMORY;
            }
            mesher__point_search(&s, c);
        }
        mesher__expand(&s);
        left = s.num_queue - s.done;
        if (!left) break;
        if (left >= 4) left = left < MESHER__TESTS ? left & ~3u : (uint32_t)MESHER__TESTS;
        state = mesher__test(&s, left);
        if (state == MESHER__DONE && s.num_in > c->most) state = MESHER__GIVEN_UP;
        if (state != MESHER__DONE) break;
    }
    mesher__take_reached(c, s.tets, s.in, s.num_in);
    c->num_queue = s.num_queue;
    return state;
}

static void mesher__clear_marks(const mesher__cavity *c, delaunay_mesh *mesh)
{
    const delaunay_handle *queue = c->queue;
    uint32_t k, num_queue = c->num_queue;
    uint8_t *mark = mesh->mark;
    if (c->num_tets) mark[c->tets[0]] = 0;
    for (k = 0; k < num_queue; k++) mark[queue[k] >> 2] = 0;
}

/* Flags of the new tetrahedron on facet i of t: its facet 0, and the edges 3, 4, 5 among its
 * corners 1, 2, 3. */
static uint16_t mesher__inherited(uint16_t flags, int i)
{
    const uint8_t *f = delaunay_facet_order(i);
    unsigned out = flags & DELAUNAY_FACET_BIT(i) ? DELAUNAY_FACET_BIT(0) : 0;
    if (!(flags & DELAUNAY_EDGE_BITS)) return (uint16_t)out;
    if (flags & DELAUNAY_EDGE_BIT(delaunay_edge_between(f[0], f[1]))) out |= DELAUNAY_EDGE_BIT(3);
    if (flags & DELAUNAY_EDGE_BIT(delaunay_edge_between(f[0], f[2]))) out |= DELAUNAY_EDGE_BIT(4);
    if (flags & DELAUNAY_EDGE_BIT(delaunay_edge_between(f[1], f[2]))) out |= DELAUNAY_EDGE_BIT(5);
    return (uint16_t)out;
}

/* Takes tetrahedron k of the list out of the cavity. Returns 0 for the first, which contains the
 * point and must stay. */
static int mesher__cut(mesher__cavity *c, delaunay_mesh *mesh, uint32_t k)
{
    if (k == 0) return 0;
    mesh->mark[c->tets[k]] = MESHER__OUT;
    c->tets[k] = c->tets[--c->num_tets];
    c->whole = 0;
    return 1;
}

#ifdef MESHER__SIMD
/* Bits of those of four facets that p certainly sees, by the filter of mesher__sees. */
__attribute__((target("avx2"))) static int mesher__sees4(const delaunay_vertex *vertices,
                                                         const double *p, const uint32_t *v0,
                                                         const uint32_t *v1, const uint32_t *v2,
                                                         const uint32_t *v3)
{
    __m256d px = _mm256_set1_pd(p[0]), py = _mm256_set1_pd(p[1]), pz = _mm256_set1_pd(p[2]);
    __m256d ax, ay, az, al, bx, by, bz, bl, cx, cy, cz, cl, det, least;
    MESHER__LOAD(0, ax, ay, az, al);
    MESHER__LOAD(1, bx, by, bz, bl);
    MESHER__LOAD(2, cx, cy, cz, cl);
    det = _mm256_add_pd(_mm256_add_pd(_mm256_mul_pd(ax, MESHER__CROSS(by, cz, bz, cy)),
                                      _mm256_mul_pd(ay, MESHER__CROSS(bz, cx, bx, cz))),
                        _mm256_mul_pd(az, MESHER__CROSS(bx, cy, by, cx)));
    least = _mm256_mul_pd(_mm256_mul_pd(_mm256_set1_pd(2e-30), al), _mm256_mul_pd(bl, cl));
    least = _mm256_add_pd(least, _mm256_set1_pd(1e-290));
    least = _mm256_and_pd(_mm256_cmp_pd(_mm256_mul_pd(det, det), least, _CMP_GT_OQ),
                          _mm256_cmp_pd(det, _mm256_setzero_pd(), _CMP_GT_OQ));
    return _mm256_movemask_pd(least);
}
#endif

/* Does p see all facets of the boundary, strictly? */
static int mesher__sees_all(const mesher__cavity *c, const delaunay_mesh *mesh, const double *p)
{
    const mesher__facet *f = c->facets;
    uint32_t k, i, n;
    for (k = 0; k < c->num_facets; k += n) {
        int seen = 0;
        n = c->num_facets - k < 4 ? c->num_facets - k : 4;
#ifdef MESHER__SIMD
        if (c->simd)
            seen = mesher__sees4(mesh->vertices, p, f[k].v, f[k + (n > 1 ? 1 : 0)].v,
                                 f[k + (n > 2 ? 2 : 0)].v, f[k + n - 1].v);
#endif
        for (i = 0; i < n; i++)
            if (!(seen >> i & 1) && !mesher__sees(p, mesh->vertices[f[k + i].v[0]].x,
                                                  mesh->vertices[f[k + i].v[1]].x,
                                                  mesh->vertices[f[k + i].v[2]].x))
                return 0;
    }
    return 1;
}

/* Lists the boundary of a cavity, in the order of its tetrahedra. Returns 0 without memory. */
static int mesher__find_border(mesher__cavity *c, const delaunay_mesh *mesh)
{
    const delaunay_tet *tets = mesh->tets;
    delaunay_handle *border;
    uint32_t k, i, n = 0;
    if (!mesher__cavity_room(c, 0, 4 * (size_t)c->num_tets + 4)) return 0;
    border = c->border;
    for (k = 0; k < c->num_tets; k++) {
        const delaunay_handle t = c->tets[k], *next = tets[t].n;
        unsigned shut = mesh->flags[t];
        for (i = 0; i < 4; i++) {
            uint8_t seen = MESHER__FETCH(&mesh->mark[next[i] >> 2]); /* all write mark[0] */
            border[n] = 4 * t + i;
            n += (next[i] == 0) | (seen != MESHER__IN) | ((shut & DELAUNAY_FACET_BIT(i)) != 0);
        }
    }
    c->num_border = n;
    return 1;
}

/* Fills in c->facets for a listed boundary. Returns 0 without memory. */
static int mesher__take_border(mesher__cavity *c, const delaunay_mesh *mesh,
                               const delaunay_handle *border, uint32_t n)
{
    const delaunay_tet *tets = mesh->tets;
    const uint16_t *flags = mesh->flags;
    mesher__facet *facet;
    uint32_t k;
    if (c->shared && n > c->cap_facets) return 0;
    if (!mesher__room(c->memory, &c->facets, &c->cap_facets, 0, n, sizeof *c->facets)) return 0;
    for (k = 0, facet = c->facets; k < n; k++, facet++) {
        const delaunay_handle h = border[k];
        const delaunay_tet *tet = tets + (h >> 2);
        const uint8_t *f = delaunay_facet_order((int)(h & 3));
        const uint32_t a = tet->v[f[0]], b = tet->v[f[1]], d = tet->v[f[2]];
        const delaunay_handle outer = tet->n[h & 3];
        facet->v[0] = a;
        facet->v[1] = b;
        facet->v[2] = d;
        facet->outer = outer;
        facet->flags = mesher__inherited(flags[h >> 2], (int)(h & 3));
    }
    c->num_facets = n;
    return 1;
}

/* Lists the boundary of a cavity and fills in c->facets. Returns 0 without memory. */
static int mesher__borders(mesher__cavity *c, const delaunay_mesh *mesh)
{
    return mesher__find_border(c, mesh) &&
           mesher__take_border(c, mesh, c->border, c->num_border);
}

/* Does p see those facets of tetrahedron t that are on the cavity's boundary? */
static int mesher__sees_border(const delaunay_mesh *mesh, const double *p, delaunay_handle t)
{
    const delaunay_tet *tet = mesh->tets + t;
    int i;
    for (i = 0; i < 4; i++) {
        const uint8_t *f = delaunay_facet_order(i);
        if (tet->n[i] && mesh->mark[tet->n[i] >> 2] == MESHER__IN &&
            !(mesh->flags[t] & DELAUNAY_FACET_BIT(i)))
            continue;
        if (!mesher__sees(p, mesh->vertices[tet->v[f[0]]].x, mesh->vertices[tet->v[f[1]]].x,
                          mesh->vertices[tet->v[f[2]]].x))
            return 0;
    }
    return 1;
}

/* Cuts tetrahedra off until the point sees the whole boundary, strictly. Returns 1; 0 if it never
 * does; -1 without memory. */
static int mesher__make_star(mesher__cavity *c, delaunay_mesh *mesh, const double *p)
{
    uint32_t k;
    int again = 1;
    if (!mesher__borders(c, mesh)) return -1;
    if (mesher__sees_all(c, mesh, p)) return 1;
    while (again) {
        again = 0;
        for (k = 0; k < c->num_tets; k++) {
            if (mesher__sees_border(mesh, p, c->tets[k])) continue;
            if (!mesher__cut(c, mesh, k)) return 0;
            k--;
            again = 1;
        }
    }
    return mesher__borders(c, mesh) ? 1 : -1;
}

/* Where the value of the boundary's directed edge a-b (local numbers) is, or is to be entered. */
static inline uint32_t *mesher__edge_slot(mesher__cavity *c, uint32_t a, uint32_t b)
{
    uint64_t key = ((uint64_t)(a + 1) << 32) | b;
    uint32_t k;
    if (c->num_locals <= MESHER__LOCAL) return c->matrix + (a << c->row | b);
    k = (uint32_t)((key * 0x9e3779b97f4a7c15u) >> 40) & c->hash_mask;
    while (c->hash_key[k] && c->hash_key[k] != key) k = (k + 1) & c->hash_mask;
    if (!c->hash_key[k]) c->hash_value[k] = 0;
    return c->hash_value + k;
}

/* Enters an edge of a large boundary. */
static void mesher__enter_edge(mesher__cavity *c, uint32_t a, uint32_t b, uint32_t value)
{
    uint32_t *slot = mesher__edge_slot(c, a, b);
    *slot = value;
    c->hash_key[slot - c->hash_value] = ((uint64_t)(a + 1) << 32) | b;
}

static int mesher__hash_room(mesher__cavity *c)
{
    uint32_t cells = 256;
    while (cells < 8 * c->num_facets) cells *= 2;
    if (cells > c->cap_hash) {
        if (c->shared) return 0;
        delaunay_release(c->memory, c->hash_key);
        delaunay_release(c->memory, c->hash_value);
        c->hash_key = (uint64_t *)delaunay_alloc(c->memory, cells, sizeof *c->hash_key);
        c->hash_value = (uint32_t *)delaunay_alloc(c->memory, cells, sizeof *c->hash_value);
        c->cap_hash = c->hash_key && c->hash_value ? cells : 0;
        if (!c->cap_hash) return 0;
    }
    c->hash_mask = cells - 1;
    memset(c->hash_key, 0, cells * sizeof *c->hash_key);
    return 1;
}

/* Numbers the vertices of the boundary, by their places in c->vertices. vertices[v].local need not
 * be initialised: a number counts only if c->vertices has v there. */
static void mesher__number_border(mesher__cavity *c, delaunay_vertex *vertices)
{
    uint32_t *list = c->vertices, n = 0, l, v;
    mesher__facet *f = c->facets, *end = f + c->num_facets;
    int i;
    for (; f < end; f++)
        for (i = 0; i < 3; i++) {
            v = f->v[i];
            uint32_t is_new;
            l = vertices[v].local;
            l = l < n ? l : n;
            list[n] = v;
            is_new = list[l] != v || l == n;
            l = is_new ? n : l;
            n += is_new;
            vertices[v].local = f->local[i] = l;
        }
    c->num_vertices = c->num_locals = n;
}

/* The same for a whole cavity. A vertex that several tetrahedra brought is in c->vertices several
 * times; its number is the last of these places, so no step waits for another. Then c->vertices is
 * condensed to all vertices of the cavity, once each; the numbers stay. */
static void mesher__number_whole(mesher__cavity *c, delaunay_vertex *vertices)
{
    uint32_t *list = c->vertices, k, i, n = 0;
    const uint32_t num_locals = c->num_tets + 3;
    mesher__facet *f = c->facets, *end = f + c->num_facets;
    for (k = 0; k < num_locals; k++) vertices[list[k]].local = k;
    for (k = 0; k < num_locals; k++) {
        uint32_t v = list[k];
        list[n] = v;
        n += vertices[v].local == k;
    }
    for (; f < end; f++)
        for (i = 0; i < 3; i++) f->local[i] = vertices[f->v[i]].local;
    c->num_locals = num_locals;
    c->num_vertices = n;
}

/* Enters the directed edges of a boundary whose vertices have been numbered. Returns 0 without
 * memory. */
static int mesher__enter_edges(mesher__cavity *c)
{
    const mesher__facet *f = c->facets;
    const uint32_t end = 4 * c->num_facets;
    const int row = c->row;
    uint32_t *matrix = c->matrix, k;
    if (c->num_locals > MESHER__LOCAL) {
        if (!mesher__hash_room(c)) return 0;
        for (k = 0; k < end; k += 4, f++) {
            mesher__enter_edge(c, f->local[1], f->local[2], k + 1);
            mesher__enter_edge(c, f->local[2], f->local[0], k + 2);
            mesher__enter_edge(c, f->local[0], f->local[1], k + 3);
        }
        return 1;
    }
    for (k = 0; k < end; k += 4, f++) {
        const uint32_t l0 = f->local[0], l1 = f->local[1], l2 = f->local[2];
        matrix[l1 << row | l2] = k + 1;
        matrix[l2 << row | l0] = k + 2;
        matrix[l0 << row | l1] = k + 3;
    }
    return 1;
}

/* Numbers the vertices of the boundary and enters its directed edges. Returns 0 without memory. */
static int mesher__number(mesher__cavity *c, delaunay_mesh *mesh)
{
    if (c->whole) {
        mesher__number_whole(c, mesh->vertices);
    } else {
        const size_t need = 3 * (size_t)c->num_facets;
        if (c->shared && need > c->cap_vertices) return 0;
        if (!mesher__room(c->memory, &c->vertices, &c->cap_vertices, 0, need, sizeof *c->vertices))
            return 0;
        mesher__number_border(c, mesh->vertices);
    }
    c->row = c->num_locals <= MESHER__LOCAL / 2 ? MESHER__ROW - 1 : MESHER__ROW;
    return mesher__enter_edges(c);
}

/* Does the boundary have the edge a-b? */
static int mesher__has_edge(mesher__cavity *c, delaunay_mesh *mesh, uint32_t a, uint32_t b)
{
    static const uint8_t start[4] = {0, 1, 2, 0}, end[4] = {0, 2, 0, 1};
    const uint32_t s = *mesher__edge_slot(c, mesh->vertices[a].local, mesh->vertices[b].local);
    const uint32_t *v;
    if ((s & 3) == 0 || s >> 2 >= c->num_facets) return 0;
    v = c->facets[s >> 2].v;
    return v[start[s & 3]] == a && v[end[s & 3]] == b;
}

/* Is a vertex of the cavity not on its boundary? For a whole cavity, by Euler's formula for the
 * boundary, a sphere; else by a look at each of them. */
static int mesher__swallows_vertex(const mesher__cavity *c, const delaunay_mesh *mesh)
{
    uint32_t k;
    int i;
    if (c->whole) return 2 * c->num_vertices != c->num_facets + 4;
    for (k = 0; k < c->num_tets; k++)
        for (i = 0; i < 4; i++) {
            uint32_t v = mesh->tets[c->tets[k]].v[i], l = mesh->vertices[v].local;
            if (l >= c->num_vertices || c->vertices[l] != v) return 1;
        }
    return 0;
}

/* Would the insertion remove something that must stay? All vertices and constrained edges of the
 * cavity must be on its boundary. Returns 0 if they are; -1 if a vertex is not; if an edge is not,
 * 1 + the index of a tetrahedron at it. */
static int mesher__swallows(mesher__cavity *c, delaunay_mesh *mesh)
{
    uint32_t k;
    int e;
    if (mesher__swallows_vertex(c, mesh)) return -1;
    for (k = 0; k < c->num_tets; k++) {
        delaunay_handle t = c->tets[k];
        unsigned flags = mesh->flags[t];
        for (e = 0; (flags & DELAUNAY_EDGE_BITS) && e < 6; e++) {
            const uint8_t *ends = delaunay_edge_order(e);
            const uint32_t *v = mesh->tets[t].v;
            if ((flags & DELAUNAY_EDGE_BIT(e)) &&
                !mesher__has_edge(c, mesh, v[ends[0]], v[ends[1]]))
                return (int)k + 1;
        }
    }
    return 0;
}

/* Is p far enough from the vertices and the constrained facets around it? */
static int mesher__keeps_distance(const mesher__refiner *r, const mesher__cavity *c,
                                  const mesher__proposal *p)
{
    const delaunay_vertex *vertices = r->mesh->vertices;
    const double *size = r->domain->size;
    uint32_t k;
    int i, wishes = mesher__has_wishes(r->options);
    for (k = 0; k < c->num_vertices; k++) {
        uint32_t v = c->vertices[k];
        if (mesher__too_near(p->x, vertices[v].x, p->h + size[v])) return 0;
    }
    for (k = 0; k < c->num_facets; k++) {
        const uint32_t *v = c->facets[k].v;
        double a[3], b[3], d[3], n[3], low, height;
        if (!(c->facets[k].flags & DELAUNAY_FACET_BIT(0))) continue;
        for (i = 0; i < 3; i++) {
            a[i] = vertices[v[1]].x[i] - vertices[v[0]].x[i];
            b[i] = vertices[v[2]].x[i] - vertices[v[0]].x[i];
            d[i] = vertices[v[0]].x[i] - p->x[i];
        }
        n[0] = a[1] * b[2] - a[2] * b[1];
        n[1] = a[2] * b[0] - a[0] * b[2];
        n[2] = a[0] * b[1] - a[1] * b[0];
        height = n[0] * d[0] + n[1] * d[1] + n[2] * d[2];
        low = MESHER__LOW / 3 * (size[v[0]] + size[v[1]] + size[v[2]]);
        if (wishes && low > p->h) low = p->h; /* large facets near a small source */
        if (height * height < low * low * (n[0] * n[0] + n[1] * n[1] + n[2] * n[2])) return 0;
    }
    return 1;
}

/* Takes slots for the tetrahedra of the ball (those around the new vertex): first those of the
 * cavity, then free ones. Room has been made. */
static void mesher__take_slots(mesher__cavity *c, delaunay_mesh *mesh)
{
    mesher__section *pool = c->pool;
    delaunay_handle *slot = c->slots;
    const uint32_t num_facets = c->num_facets,
                   reused = c->num_tets < num_facets ? c->num_tets : num_facets;
    uint32_t k;
    memcpy(slot, c->tets, reused * sizeof *slot);
    for (k = reused; k < num_facets; k++)
        if (c->shared)
            slot[k] = pool->num_slots ? pool->slots[--pool->num_slots] : pool->fresh++;
        else slot[k] = mesh->num_free ? mesh->free_tets[--mesh->num_free] : mesh->num_tets++;
}

/* Deletes tetrahedron t. */
static void mesher__give_slot(mesher__cavity *c, delaunay_mesh *mesh, delaunay_handle t)
{
    memset(mesh->tets + t, 0, sizeof *mesh->tets);
    mesh->flags[t] = MESHER__SEEN;
    if (c->shared) c->pool->slots[c->pool->num_slots++] = t;
    else mesh->free_tets[mesh->num_free++] = t;
}

/* A capacity for at least so many, and for some to spare as far as the most allows. */
static size_t mesher__with_spare(size_t least, size_t spare, size_t most)
{
    if (least >= most) return least;
    return spare < most - least ? least + spare : most;
}

/* Makes room in the mesh for so many tetrahedra and some more; 0: cannot. */
static int mesher__tet_room(delaunay_mesh *mesh, size_t tets, size_t spare)
{
    const size_t most = (size_t)((delaunay_handle)-1) / 4 - 1;
    return tets <= mesh->cap_tets ||
           delaunay_reserve(mesh, 0, mesher__with_spare(tets, spare, most)) == DELAUNAY_OK;
}

/* Makes room in the mesh for the ball on the cavity's boundary. */
static int mesher__ball_room(mesher__refiner *r, mesher__cavity *c)
{
    delaunay_mesh *mesh = r->mesh;
    size_t tets = (size_t)mesh->num_tets + c->num_facets, cap;
    if (!mesher__cavity_room(c, 0, c->num_facets)) return 0;
    if (c->shared) {
        const mesher__section *pool = c->pool;
        size_t slots = pool->num_slots + (size_t)(pool->fresh_end - pool->fresh);
        return c->num_facets <= c->num_tets + slots &&
               c->num_tets + pool->num_slots <= c->num_facets + pool->cap_slots;
    }
    if (!mesher__tet_room(mesh, tets, tets / 4)) return 0;
    if (c->num_tets > c->num_facets &&
        mesh->cap_free - mesh->num_free < c->num_tets - c->num_facets) {
        cap = mesh->cap_free;
        if (!mesher__room(r->memory, &mesh->free_tets, &cap, mesh->num_free,
                          mesh->num_free + (size_t)c->num_tets, sizeof *mesh->free_tets))
            return 0;
        mesh->cap_free = (delaunay_handle)cap;
    }
    return 1;
}

/* Makes room for count more vertices, with their sizes and homes. */
static int mesher__vertex_room(mesher__refiner *r, size_t count)
{
    delaunay_mesh *mesh = r->mesh;
    size_t vertices = (size_t)mesh->num_vertices + count, cap;
    if (vertices > mesh->cap_vertices &&
        delaunay_reserve(mesh, mesher__with_spare(vertices, vertices / 4, UINT32_MAX - 1), 0) !=
            DELAUNAY_OK)
        return 0;
    if (mesh->cap_vertices > r->domain->cap_size) {
        cap = r->domain->cap_size;
        if (!mesher__room(&r->domain->memory, &r->domain->size, &cap, mesh->num_vertices,
                          mesh->cap_vertices, sizeof(double)))
            return 0;
        r->domain->cap_size = (uint32_t)cap;
    }
    return mesher__room(r->memory, &r->home, &r->cap_home, mesh->num_vertices, mesh->cap_vertices,
                        sizeof *r->home);
}

/* The facet of the ball that belongs to entry s of an edge. */
static inline delaunay_handle mesher__across(const delaunay_handle *slot, uint32_t s)
{
    return 4 * slot[s >> 2] + (s & 3);
}

/* Links the tetrahedra of a ball to each other; slot[k] is the one on facet k. */
static void mesher__link_ball(mesher__cavity *c, delaunay_tet *tets, const delaunay_handle *slot)
{
    const mesher__facet *f = c->facets;
    const uint32_t *matrix = c->matrix, num_facets = c->num_facets;
    const int row = c->row, little = c->num_locals <= MESHER__LOCAL;
    uint32_t k;
    for (k = 0; k < num_facets; k++, f++) {
        const uint32_t l0 = f->local[0], l1 = f->local[1], l2 = f->local[2];
        delaunay_handle *n = tets[slot[k]].n;
        if (little) {
            n[1] = mesher__across(slot, matrix[l2 << row | l1]);
            n[2] = mesher__across(slot, matrix[l0 << row | l2]);
            n[3] = mesher__across(slot, matrix[l1 << row | l0]);
        } else {
            n[1] = mesher__across(slot, *mesher__edge_slot(c, l2, l1));
            n[2] = mesher__across(slot, *mesher__edge_slot(c, l0, l2));
            n[3] = mesher__across(slot, *mesher__edge_slot(c, l1, l0));
        }
    }
}

/* Fills the cavity with the tetrahedra of vertex p and the facets of the boundary. The cavity's own
 * slots have its colour already. */
static void mesher__fill(mesher__cavity *c, delaunay_mesh *mesh, uint32_t p)
{
    const uint32_t color = mesh->color[c->tets[0]], num_facets = c->num_facets;
    const mesher__facet *f = c->facets;
    const delaunay_handle *slot = c->slots;
    delaunay_handle *vertex_tet = mesh->vertex_tet;
    uint16_t *flags = mesh->flags;
    delaunay_tet *tets = mesh->tets;
    uint32_t k;
    mesher__clear_marks(c, mesh);
    mesher__take_slots(c, mesh);
    for (k = 0; k < num_facets; k++, f++) {
        const delaunay_handle t = slot[k], outer = f->outer;
        const uint32_t v0 = f->v[0], v1 = f->v[1], v2 = f->v[2];
        delaunay_tet *tet = tets + t;
        flags[t] = f->flags;
        tet->v[0] = p;
        tet->v[1] = v0;
        tet->v[2] = v1;
        tet->v[3] = v2;
        tet->n[0] = outer;
        vertex_tet[v0] = vertex_tet[v1] = vertex_tet[v2] = t;
        if (outer) tets[outer >> 2].n[outer & 3] = 4 * t;
    }
    for (k = c->num_tets; k < num_facets; k++) mesh->color[slot[k]] = color;
    vertex_tet[p] = slot[0];
    mesher__link_ball(c, tets, slot);
    for (k = num_facets; k < c->num_tets; k++) mesher__give_slot(c, mesh, c->tets[k]);
}

/* Makes the cavity of p star-shaped and free of anything that must stay. */
static int mesher__shape(mesher__cavity *c, delaunay_mesh *mesh, const double *p)
{
    int state, swallowed;
    for (;;) {
        state = mesher__make_star(c, mesh, p);
        if (state <= 0) return state;
        if (!mesher__number(c, mesh)) return MESHER__NO_MEMORY;
        swallowed = mesher__swallows(c, mesh);
        if (swallowed == 0) return MESHER__DONE;
        if (swallowed < 0) return MESHER__GIVEN_UP;
        if (!mesher__cut(c, mesh, swallowed == 1 ? c->num_tets - 1 : (uint32_t)swallowed - 1))
            return MESHER__GIVEN_UP;
    }
}

/* Takes over a plain cavity, as delaunay_plain_cavity has found it. Returns GENERAL if a
 * constrained edge is inside it: the general way cuts the cavity until it is not. */
static int mesher__take_plain(mesher__cavity *c, delaunay_mesh *mesh)
{
    const delaunay_plain *plain = &c->plain;
    if (!mesher__cavity_room(c, plain->num_tets, plain->num_border)) return MESHER__NO_MEMORY;
    mesher__take_reached(c, mesh->tets, plain->tets, plain->num_tets);
    if (!mesher__take_border(c, mesh, plain->border, plain->num_border) || !mesher__number(c, mesh))
        return MESHER__NO_MEMORY;
    if (mesher__swallows_vertex(c, mesh)) return MESHER__GIVEN_UP;
    if (plain->flags & DELAUNAY_EDGE_BITS && mesher__swallows(c, mesh)) return MESHER__GENERAL;
    return MESHER__DONE;
}

/* Makes the cavity of p, which is in t, and numbers its boundary. Returns GIVEN_UP if p cannot be
 * inserted. */
static int mesher__carve(mesher__cavity *c, delaunay_mesh *mesh, const double *p, delaunay_handle t)
{
    int state = MESHER__GENERAL;
    c->num_tets = c->num_queue = c->num_facets = 0;
    switch (delaunay_plain_cavity(&c->plain, mesh, p, t, c->shared ? &c->section : NULL)) {
    case DELAUNAY_PLAIN: state = mesher__take_plain(c, mesh); break;
    case DELAUNAY_PLAIN_ELSEWHERE: return MESHER__LATER;
    case DELAUNAY_NOT_PLAIN: break;
    }
    if (state != MESHER__GENERAL) return state;
    c->num_tets = c->num_queue = c->num_facets = 0;
    state = mesher__dig(c, mesh, p, t);
    return state == MESHER__DONE ? mesher__shape(c, mesh, p) : state;
}

/* Where the walk to a point of a section starts: at a tetrahedron of the section, near the point if
 * possible. Returns 0 if the section has none. */
static delaunay_handle mesher__start(const mesher__cavity *c, const delaunay_mesh *mesh,
                                     const mesher__proposal *p)
{
    if (p->start && !delaunay_is_deleted(mesh, p->start)) return p->start;
    return c->nearby ? c->nearby : c->pool->start;
}

/* The tetrahedron that contains the point. Returns 0 if it is not found or, with *later set, is not
 * in this section. */
static delaunay_handle mesher__find(const mesher__refiner *r, mesher__cavity *c,
                                    const mesher__proposal *p, int *later)
{
    const delaunay_mesh *mesh = r->mesh;
    delaunay_handle t = p->tet;
    int k;
    *later = 0;
    if (c->shared) {
        t = mesher__start(c, mesh, p);
        if (t) t = mesher__walk(c, mesh, p->x, t, later);
        *later = !t;
        return t;
    }
    if (!t || delaunay_is_deleted(mesh, t))
        t = c->nearby ? c->nearby : mesh->vertex_tet[r->field.tets[p->home].v[0]];
    t = mesher__walk(c, mesh, p->x, t, later);
    for (k = 0; !t && k < 4; k++) /* a hole or a cycle was in the way: starts elsewhere */
        t = mesher__walk(c, mesh, p->x, mesh->vertex_tet[r->field.tets[p->home].v[k]], later);
    return t;
}

/* How many tetrahedra a cavity may have. The searches for points that were given up may have looked
 * at MESHER__LOSS tetrahedra, and at MESHER__LOSS_EACH more for each tetrahedron of the mesh and
 * each point inserted; beyond that, only cavities of up to MESHER__PLAIN are worthwhile. Over
 * needles of a surface that are a hundred times longer than the sizes, the cavity of every point
 * has thousands of tetrahedra, and hardly any point can be inserted. */
enum { MESHER__LOSS = 1 << 20, MESHER__LOSS_EACH = 32, MESHER__PLAIN = 128 };

static uint32_t mesher__largest(const mesher__refiner *r)
{
    return r->lost > MESHER__LOSS + MESHER__LOSS_EACH * (r->inserted + r->num_tets)
               ? (uint32_t)MESHER__PLAIN : UINT32_MAX;
}

/* Inserts one point as vertex p->vertex; anything but DONE leaves the mesh untouched. */
static int mesher__insert(mesher__refiner *r, mesher__cavity *c, const mesher__proposal *p)
{
    delaunay_mesh *mesh = r->mesh;
    int state, later;
    delaunay_handle t = mesher__find(r, c, p, &later);
    if (later) return MESHER__LATER;
    if (!t || mesh->color[t] != p->region || !mesher__is_clear(r, p, p->h, t))
        return MESHER__GIVEN_UP;
    state = mesher__carve(c, mesh, p->x, t);
    if (state == MESHER__DONE && !mesher__keeps_distance(r, c, p)) state = MESHER__GIVEN_UP;
    if (state == MESHER__DONE && !mesher__ball_room(r, c)) state = MESHER__NO_MEMORY;
    if (state == MESHER__GIVEN_UP) /* a plain cavity has no queue; its boundary stands in for it */
        *(c->shared ? &c->pool->lost : &r->lost) += c->whole ? c->num_tets + c->num_facets
                                                             : c->num_queue;
    if (state != MESHER__DONE) {
        mesher__clear_marks(c, mesh);
        return c->shared && state == MESHER__NO_MEMORY ? MESHER__LATER : state;
    }
    memcpy(mesh->vertices[p->vertex].x, p->x, sizeof p->x);
    r->domain->size[p->vertex] = p->h;
    r->home[p->vertex] = p->home;
    if (c->shared) {
        c->pool->inserted++;
        c->pool->born += c->num_facets;
        c->pool->dead += c->num_tets;
    } else {
        r->inserted++;
        r->num_tets += c->num_facets;
        r->num_tets -= c->num_tets;
    }
    mesher__fill(c, mesh, p->vertex);
    c->nearby = mesh->vertex_tet[p->vertex];
    return MESHER__DONE;
}

/* The tetrahedron that proposed point p, which cannot be inserted, is not asked again. */
static void mesher__give_up(delaunay_mesh *mesh, const mesher__proposal *p)
{
    if (p->source && mesher__stamp(mesh, p->source) == p->stamp)
        mesh->flags[p->source] |= MESHER__SEEN;
}

/* One thread inserts points begin to end of the order. */
static mesher_result mesher__insert_serially(mesher__refiner *r, size_t begin, size_t end)
{
    size_t k;
    for (k = begin; k < end; k++) {
        mesher_result result = mesher__over_budget(r, (k & 255) == 0);
        mesher__proposal *p = r->points + r->order[k].value;
        int numbered = p->vertex != 0;
        if (result != MESHER_OK) return result;
        if ((k & 4095) == 0 && mesher__progress(r->options, "refine", -1)) return MESHER_CANCELLED;
        if (!numbered) {
            if (!mesher__vertex_room(r, 1)) return mesher__no_memory(r);
            p->vertex = delaunay_add_vertex(r->mesh, p->x, DELAUNAY_NO_ID);
        }
        r->cavity.most = mesher__largest(r);
        p->state = mesher__insert(r, &r->cavity, p);
        if (p->state != MESHER__DONE && !numbered) r->mesh->num_vertices--;
        if (p->state == MESHER__NO_MEMORY) return mesher__no_memory(r);
        if (p->state == MESHER__GIVEN_UP) mesher__give_up(r->mesh, p);
    }
    return MESHER_OK;
}

/* -- insertion by several threads [Marot 2020, 4.2-4.4]: the curve is cut into sections with
 * equally many points. A thread inserts the points of one section, and changes only tetrahedra all
 * of whose vertices are in that section. Points that need others are left for the next pass, which
 * cuts other sections, and after the last pass for one thread. The sections do not depend on the
 * number of threads, so neither does the mesh.
 *
 * Why there is no race: a tetrahedron belongs to a section if all of its vertices do, else to none.
 * A neighbour of a section's own tetrahedron has three vertices of the section, so it belongs to
 * the section or to none; then nobody writes its vertices, and it is a neighbour of no other
 * section's tetrahedra, so its mark and its handle to the section's tetrahedron are written by that
 * section alone. All else is written for a section's own vertices and tetrahedra only. */

enum {
    MESHER__FEW = 4096,      /* one thread inserts rounds of fewer points */
    MESHER__SECTION = 16384, /* points of a section; those at its border are tried in vain */
    MESHER__PASSES = 4
};

/* The section that a key on the curve is in; border[i]: the least key of section i. */
static uint32_t mesher__section_of(const uint64_t *border, uint32_t parts, uint64_t key)
{
    uint32_t i = 0, j = parts;
    while (j - i > 1) {
        uint32_t middle = (i + j) / 2;
        if (border[middle] <= key) i = middle;
        else j = middle;
    }
    return i;
}

/* Cuts the curve of this pass into sections with equally many of count points of the order. Sorts
 * these points along it, and sets the section of every vertex of the mesh, as its key. Returns how
 * many sections there are; 0 without memory. */
static uint32_t mesher__cut_curve(mesher__refiner *r, size_t begin, size_t count, int pass)
{
    delaunay_mesh *mesh = r->mesh;
    uint32_t parts = (uint32_t)(count / MESHER__SECTION), i;
    uint64_t border[MESHER__SECTIONS];
    int threads = delaunay_threads(&r->options->host);
    int64_t n;
    hilbert_box box = r->box;
    size_t k;
    if (parts < 2) parts = 2;
    if (parts > MESHER__SECTIONS) parts = MESHER__SECTIONS;
    for (i = 0; i < 3; i++) box.middle[i] = pass ? 0.35 + 0.1 * ((pass + (int)i) % 4) : 0.5;
    if (!mesher__room(r->memory, &r->keys, &r->cap_keys, 0,
                      mesh->num_vertices > count ? mesh->num_vertices : count, sizeof *r->keys))
        return 0;
    if (hilbert_keys3(r->keys, mesh->vertices[0].x, sizeof *mesh->vertices, mesh->num_vertices,
                      &box, threads) != HILBERT_OK)
        return 0;
    for (k = 0; k < count; k++)
        r->order[begin + k].key = r->keys[r->points[r->order[begin + k].value].vertex];
    if (mesher__sort(r->domain, r->order + begin, count) != MESHER_OK) return 0;
    for (i = 0; i < parts; i++) {
        mesher__section *s = r->sections + i;
        memset(s, 0, sizeof *s);
        s->first = begin + count * i / parts;
        s->end = begin + count * (i + 1) / parts;
        border[i] = i ? r->order[s->first].key : 0;
    }
    /* Shared: the keys and borders, read only; each vertex is written once. */
    MESHER__OMP(omp parallel for num_threads(threads))
    for (n = 1; n < (int64_t)mesh->num_vertices; n++)
        mesh->vertices[n].key = mesher__section_of(border, parts, r->keys[n]);
    mesh->vertices[0].key = UINT32_MAX;
    return parts;
}

/* Is tetrahedron t there, with all its vertices in the section of this number? Its slot then stays
 * with the section for the whole pass, whatever becomes of it. */
static int mesher__is_of(const delaunay_mesh *mesh, delaunay_handle t, uint32_t section)
{
    const uint32_t *v = mesh->tets[t].v;
    int j;
    if (!t || delaunay_is_deleted(mesh, t)) return 0;
    for (j = 0; j < 4 && mesh->vertices[v[j]].key == section; j++) {}
    return j == 4;
}

/* Finds a tetrahedron of each section and, for each point, one of its section near it, if there is
 * one. Nobody changes the mesh meanwhile. */
static void mesher__set_walk_starts(mesher__refiner *r, uint32_t parts)
{
    delaunay_mesh *mesh = r->mesh;
    int threads = delaunay_threads(&r->options->host);
    uint32_t v, found = 0;
    int i, j;
    for (v = 1; v < mesh->num_vertices && found < parts; v++) {
        mesher__section *s = r->sections + mesh->vertices[v].key;
        if (s >= r->sections + parts || s->start) continue;
        if (!mesher__is_of(mesh, mesh->vertex_tet[v], mesh->vertices[v].key)) continue;
        s->start = mesh->vertex_tet[v];
        found++;
    }
    (void)threads;
    /* Shared: the mesh, read only; points are written by section. */
    MESHER__OMP(omp parallel for private(j) schedule(dynamic, 1) num_threads(threads))
    for (i = 0; i < (int)parts; i++) {
        size_t k;
        for (k = r->sections[i].first; k < r->sections[i].end; k++) {
            mesher__proposal *p = r->points + r->order[k].value;
            p->start = mesher__is_of(mesh, p->tet, (uint32_t)i) ? p->tet : 0;
            for (j = 0; j < 4 && p->tet && !p->start && !delaunay_is_deleted(mesh, p->tet); j++) {
                delaunay_handle t = mesh->vertex_tet[mesh->tets[p->tet].v[j]];
                if (mesher__is_of(mesh, t, (uint32_t)i)) p->start = t;
            }
        }
    }
}

/* Deals each section free slots for its new tetrahedra. Returns 0 without memory. */
static int mesher__deal_slots(mesher__refiner *r, uint32_t parts)
{
    delaunay_mesh *mesh = r->mesh;
    size_t total = 0, fresh, used = 0, tets;
    uint32_t i;
    for (i = 0; i < parts; i++) total += 8 * (r->sections[i].end - r->sections[i].first) + 256;
    fresh = total > mesh->num_free ? total - mesh->num_free : 0;
    tets = mesh->num_tets + fresh;
    if (!mesher__tet_room(mesh, tets, tets / 8)) return 0;
    if (!mesher__room(r->memory, &r->slots, &r->cap_slots, 0, 2 * total, sizeof *r->slots))
        return 0;
    for (i = 0; i < parts; i++) {
        mesher__section *s = r->sections + i;
        size_t want = 8 * (s->end - s->first) + 256;
        s->slots = r->slots + used;
        s->cap_slots = (uint32_t)(2 * want);
        used += 2 * want;
        while (s->num_slots < want && mesh->num_free)
            s->slots[s->num_slots++] = mesh->free_tets[--mesh->num_free];
        s->fresh = mesh->num_tets;
        mesh->num_tets += (delaunay_handle)(want - s->num_slots);
        s->fresh_end = mesh->num_tets;
    }
    return 1;
}

/* Takes back the slots that were not used, and sums up the counts. Returns 0 if there is no memory
 * to list the slots; they are deleted all the same. */
static int mesher__collect_slots(mesher__refiner *r, uint32_t parts)
{
    delaunay_mesh *mesh = r->mesh;
    size_t need = mesh->num_free, cap = mesh->cap_free;
    uint32_t i, k;
    for (i = 0; i < parts; i++) {
        mesher__section *s = r->sections + i;
        need += s->num_slots + (size_t)(s->fresh_end - s->fresh);
        r->inserted += s->inserted;
        r->lost += s->lost;
        r->num_tets += s->born;
        r->num_tets -= s->dead;
    }
    if (!mesher__room(r->memory, &mesh->free_tets, &cap, mesh->num_free, need,
                      sizeof *mesh->free_tets))
        return 0;
    mesh->cap_free = (delaunay_handle)cap;
    for (i = parts; i-- > 0;) {
        mesher__section *s = r->sections + i;
        delaunay_handle t;
        for (t = s->fresh_end; t-- > s->fresh;) mesh->free_tets[mesh->num_free++] = t;
        for (k = 0; k < s->num_slots; k++) mesh->free_tets[mesh->num_free++] = s->slots[k];
    }
    return 1;
}

/* Inserts the points of section i. caller: this is the calling thread, which reports progress and
 * looks at the clock. */
static void mesher__insert_section(mesher__refiner *r, mesher__cavity *c, uint32_t i, int caller)
{
    mesher__section *s = r->sections + i;
    const mesher_options *o = r->options;
    delaunay_handle t;
    size_t k;
    c->section = i;
    c->most = mesher__largest(r);
    c->pool = s;
    c->nearby = 0;
    for (k = s->first; k < s->end; k++) {
        mesher__proposal *p = r->points + r->order[k].value;
        p->state = MESHER__LATER;
        if (caller && (k & 1023) == 0 && !MESHER__FETCH(&r->cancelled)) {
            int stop = mesher__progress(o, "refine", -1) ? 1 : 0;
            if (!stop && o->max_seconds > 0 &&
                delaunay_seconds(&o->host) - r->start > o->max_seconds)
                stop = 2;
            if (stop) MESHER__STORE(&r->cancelled, stop);
        }
        if (k + 4 < s->end) MESHER__PREFETCH(r->points + r->order[k + 4].value);
        if (!MESHER__FETCH(&r->cancelled)) p->state = mesher__insert(r, c, p);
    }
    for (t = s->fresh; t < s->fresh_end; t++) { /* dealt, and not used */
        memset(r->mesh->tets + t, 0, sizeof *r->mesh->tets);
        r->mesh->flags[t] = MESHER__SEEN;
    }
}

/* Makes room for the scratch of each thread, so that threads need not allocate. */
static int mesher__cavities(mesher__refiner *r, int threads)
{
    int i;
    if (threads > r->num_cavities) {
        mesher__cavity *all = (mesher__cavity *)delaunay_grow_zeroed(
            r->memory, r->cavities, (size_t)r->num_cavities, (size_t)threads, sizeof *all);
        if (!all) return 0;
        r->cavities = all;
        r->num_cavities = threads;
    }
    for (i = 0; i < threads; i++) {
        mesher__cavity *c = r->cavities + i;
        c->memory = r->memory;
        c->simd = r->cavity.simd;
        c->shared = 0;
        c->num_tets = 0;
        c->num_facets = 512;
        if (!mesher__room(r->memory, &c->facets, &c->cap_facets, 0, 2048, sizeof *c->facets) ||
            !mesher__room(r->memory, &c->vertices, &c->cap_vertices, 0, 3 * 2048,
                          sizeof *c->vertices) ||
            !mesher__cavity_room(c, 1024, 4 * 1024 + 4) || !mesher__hash_room(c))
            return 0;
        c->shared = 1;
    }
    return 1;
}

/* One pass of sections over *count points of the order from begin on. On return those left for
 * later come first, and *count is their number. */
static mesher_result mesher__insert_in_sections(mesher__refiner *r, size_t begin, size_t *count,
                                                int pass)
{
    int threads = delaunay_threads(&r->options->host);
    uint32_t parts = mesher__cut_curve(r, begin, *count, pass);
    size_t k, later = 0;
    int i;
    if (!parts || !mesher__cavities(r, threads) || !mesher__deal_slots(r, parts))
        return mesher__no_memory(r);
    mesher__set_walk_starts(r, parts);
    /* Shared: the mesh, by the rules above, and r->points by section; private: a cavity for each
     * thread. */
    MESHER__OMP(omp parallel for schedule(dynamic, 1) num_threads(threads))
    for (i = 0; i < (int)parts; i++)
        mesher__insert_section(r, r->cavities + MESHER__THREAD(), (uint32_t)i,
                               MESHER__THREAD() == 0);
    if (!mesher__collect_slots(r, parts)) return mesher__no_memory(r);
    for (k = begin; k < begin + *count; k++) {
        hxtsort_pair pair = r->order[k];
        mesher__proposal *p = r->points + pair.value;
        if (p->state == MESHER__GIVEN_UP) mesher__give_up(r->mesh, p);
        if (p->state != MESHER__LATER) continue;
        r->order[k] = r->order[begin + later];
        r->order[begin + later++] = pair;
    }
    *count = later;
    if (r->cancelled == 1) return MESHER_CANCELLED;
    if (!r->cancelled) return MESHER_OK;
    r->budget = MESHER__BUDGET_SECONDS;
    return MESHER_STOPPED_BY_BUDGET;
}

/* Gives vertex `from` the number `to`, which is free, in all tetrahedra around it. */
static mesher_result mesher__rename(mesher__refiner *r, uint32_t from, uint32_t to)
{
    delaunay_mesh *mesh = r->mesh;
    mesher__cavity *c = &r->cavity;
    uint32_t k;
    int i;
    c->num_tets = c->num_queue = 0;
    if (!mesher__cavity_room(c, 1, 0)) return mesher__no_memory(r);
    c->tets[c->num_tets++] = mesh->vertex_tet[from];
    mesh->mark[c->tets[0]] = MESHER__IN;
    for (k = 0; k < c->num_tets; k++) {
        delaunay_tet *t = mesh->tets + c->tets[k];
        int own = delaunay_local_index(t, from);
        if (!mesher__cavity_room(c, (size_t)c->num_tets + 4, 0)) {
            for (k = 0; k < c->num_tets; k++) mesh->mark[c->tets[k]] = 0;
            return mesher__no_memory(r);
        }
        for (i = 0; i < 4; i++) {
            delaunay_handle u = t->n[i] >> 2;
            if (i == own || !u || mesh->mark[u]) continue;
            mesh->mark[u] = MESHER__IN;
            c->tets[c->num_tets++] = u;
        }
    }
    for (k = 0; k < c->num_tets; k++) {
        delaunay_tet *t = mesh->tets + c->tets[k];
        mesh->mark[c->tets[k]] = 0;
        t->v[delaunay_local_index(t, from)] = to;
    }
    memcpy(mesh->vertices[to].x, mesh->vertices[from].x, sizeof mesh->vertices[to].x);
    mesh->vertex_tet[to] = mesh->vertex_tet[from];
    r->domain->size[to] = r->domain->size[from];
    r->home[to] = r->home[from];
    return MESHER_OK;
}

/* Renumbers the last vertices so that, from number first on, no number belongs to a point that was
 * not inserted. */
static mesher_result mesher__close_gaps(mesher__refiner *r, uint32_t first)
{
    delaunay_mesh *mesh = r->mesh;
    uint32_t v;
    for (v = first; v < mesh->num_vertices; v++) {
        mesher_result result;
        if (mesh->vertex_tet[v]) continue;
        while (mesh->num_vertices > v + 1 && !mesh->vertex_tet[mesh->num_vertices - 1])
            mesh->num_vertices--;
        if (mesh->num_vertices > v + 1) {
            result = mesher__rename(r, mesh->num_vertices - 1, v);
            if (result != MESHER_OK) return result;
        }
        mesh->num_vertices--;
    }
    return MESHER_OK;
}

/* Gives count points of the order the next vertex numbers. Room has been made. */
static void mesher__number_points(mesher__refiner *r, size_t begin, size_t count)
{
    delaunay_mesh *mesh = r->mesh;
    const uint32_t first = mesh->num_vertices;
    int threads = delaunay_threads_for(&r->options->host, count);
    int64_t k;
    (void)threads;
    /* Each point and its vertex are of one thread. */
    MESHER__OMP(omp parallel for schedule(static) num_threads(threads))
    for (k = 0; k < (int64_t)count; k++) {
        mesher__proposal *p = r->points + r->order[begin + (size_t)k].value;
        delaunay_vertex *v = mesh->vertices + first + k;
        p->vertex = first + (uint32_t)k;
        memcpy(v->x, p->x, sizeof p->x);
        v->key = v->local = 0;
        mesh->vertex_id[p->vertex] = DELAUNAY_NO_ID;
        mesh->vertex_tet[p->vertex] = 0;
    }
    mesh->num_vertices += (uint32_t)count;
}

/* Inserts many points: in several passes by sections, the rest by one thread. */
static mesher_result mesher__insert_many(mesher__refiner *r, size_t begin, size_t end)
{
    delaunay_mesh *mesh = r->mesh;
    uint32_t first = mesh->num_vertices;
    size_t count = end - begin;
    mesher_result result = MESHER_OK, closed;
    int pass;
    if (!mesher__vertex_room(r, count)) return mesher__no_memory(r);
    mesher__number_points(r, begin, count);
    for (pass = 0; pass < MESHER__PASSES && count >= MESHER__FEW && result == MESHER_OK; pass++)
        result = mesher__insert_in_sections(r, begin, &count, pass);
    r->cavity.nearby = 0; /* the sections may have removed it */
    if (result == MESHER_OK) result = mesher__insert_serially(r, begin, begin + count);
    closed = mesher__close_gaps(r, first);
    return closed != MESHER_OK ? closed : result;
}

/* Inserts points begin to end of the order. Tetrahedra whose points cannot be inserted are not
 * asked again. */
static mesher_result mesher__insert_range(mesher__refiner *r, size_t begin, size_t end)
{
    const uint64_t max_tets = r->options->max_tets;
    size_t n = end - begin;
    int many = n >= MESHER__FEW;
    if (max_tets && r->num_tets + 10 * (uint64_t)n > max_tets) many = 0;
    if (r->max_vertices && (uint64_t)r->mesh->num_vertices + n > r->max_vertices) many = 0;
    if ((double)n > mesher__memory_for(r)) many = 0;
    if ((uint64_t)r->mesh->num_vertices + n >= UINT32_MAX - 16) many = 0;
    if ((uint64_t)r->mesh->num_tets + 10 * (uint64_t)n >= ((delaunay_handle)-1) / 4) many = 0;
    return many ? mesher__insert_many(r, begin, end) : mesher__insert_serially(r, begin, end);
}

/* Inserts all points of the order; with rounds, round after round. */
static mesher_result mesher__insert_all(mesher__refiner *r, int rounds)
{
    mesher_result result = MESHER_OK;
    size_t begin, end;
    for (begin = 0; begin < r->num_points && result == MESHER_OK; begin = end) {
        uint64_t round = r->order[begin].key >> 60;
        for (end = rounds ? begin : r->num_points;
             end < r->num_points && r->order[end].key >> 60 == round; end++) {}
        result = mesher__insert_range(r, begin, end);
    }
    return result;
}

/* ---- >>sweeps  the whole refinement ------------------------------------------------------- */

/* Copies the mesh as it is into the background of the field. Returns 0 without memory. */
static int mesher__set_background(mesher__refiner *r)
{
    const mesher_domain *domain = r->domain;
    const delaunay_mesh *mesh = r->mesh;
    mesher__field *field = &r->field;
    /* 0: the mesh has been refined since mesher_size */
    const int has_own = domain->num_own_sizes == mesh->num_vertices;
    delaunay_handle t;
    uint32_t v;
    field->options = r->options;
    field->slope = r->options->growth > 1 ? r->options->growth - 1 : mesher__slope(r->options);
    field->least = mesher__size_floor(mesh);
    field->cap = mesher__size_cap(r->options);
    field->tets = (delaunay_tet *)delaunay_alloc(r->memory, mesh->num_tets, sizeof *field->tets);
    field->color = (uint32_t *)delaunay_alloc(r->memory, mesh->num_tets, sizeof *field->color);
    field->vertices = (mesher__field_vertex *)delaunay_alloc(r->memory, mesh->num_vertices,
                                                             sizeof *field->vertices);
    if (!field->tets || !field->color || !field->vertices) return 0;
    field->num_vertices = mesh->num_vertices;
    memcpy(field->tets, mesh->tets, (size_t)mesh->num_tets * sizeof *mesh->tets);
    memcpy(field->color, mesh->color, (size_t)mesh->num_tets * sizeof *mesh->color);
    for (t = 1; t < mesh->num_tets; t++) {
        const delaunay_handle real = mesh->tets[t].n[3];
        if (mesh->tets[t].v[3] == DELAUNAY_GHOST) field->tets[real >> 2].n[real & 3] = 0;
    }
    for (v = 1; v < mesh->num_vertices; v++) {
        mesher__field_vertex *x = field->vertices + v;
        memcpy(x->x, mesh->vertices[v].x, sizeof x->x);
        x->size = domain->size[v];
        x->own = has_own ? domain->own_size[v] : x->size;
        x->source = has_own ? domain->size_source[v] : v;
    }
    return 1;
}

/* Sets r->max_vertices: the mesh has its corners besides the vertices that the caller counts, the
 * output input vertices that are not in the mesh. */
static void mesher__set_max_vertices(mesher__refiner *r)
{
    const uint64_t most = r->options->max_vertices;
    uint64_t output = r->domain->first_corner;
    uint32_t v;
    if (!most || most > UINT32_MAX) return;
    for (v = 1; v < r->mesh->num_vertices; v++)
        output += r->home[v] && r->mesh->vertex_id[v] == DELAUNAY_NO_ID;
    r->max_vertices = most > output ? most - output + r->mesh->num_vertices : 1;
}

static mesher_result mesher__refiner_init(mesher__refiner *r, mesher_domain *domain)
{
    delaunay_mesh *mesh = &domain->mesh;
    delaunay_handle t;
    int i;
    memset(r, 0, sizeof *r);
    r->domain = domain;
    r->mesh = mesh;
    r->memory = r->cavity.memory = &mesh->memory;
    r->options = &domain->options;
    r->crew.host = &r->options->host;
#ifdef MESHER__SIMD
    r->cavity.simd = r->field.simd = __builtin_cpu_supports("avx2");
#endif
    r->start = delaunay_seconds(&r->options->host);
    if (!mesh->vertex_tet && delaunay_link_vertices(mesh) != DELAUNAY_OK)
        return mesher__no_memory(r);
    if (hilbert_box_fit3(&r->box, mesh->vertices[1].x, sizeof *mesh->vertices,
                         mesh->num_vertices - 1, r->options->host.num_threads) != HILBERT_OK)
        return MESHER_ERROR_INTERNAL;
    hilbert_box_cube(&r->box);
    for (i = 0; i < 3; i++) r->grid.origin[i] = r->box.lo[i] - 2 * (r->box.hi[i] - r->box.lo[i]);
    if (!mesher__set_background(r)) return mesher__no_memory(r);
    if (r->options->growth > 1) {
        mesher_result result = mesher__growth_init(&r->field.growth, domain, r->memory, &r->box);
        if (result != MESHER_OK)
            return result == MESHER_ERROR_OUT_OF_MEMORY ? mesher__no_memory(r) : result;
    }
    if (!mesher__room(r->memory, &r->home, &r->cap_home, 0, mesh->num_vertices, sizeof *r->home))
        return mesher__no_memory(r);
    memset(r->home, 0, mesh->num_vertices * sizeof *r->home);
    for (t = 1; t < mesh->num_tets; t++) {
        if (!mesher__is_inside(mesh, t)) continue;
        r->num_tets++;
        for (i = 0; i < 4; i++)
            if (!r->home[mesh->tets[t].v[i]]) r->home[mesh->tets[t].v[i]] = t;
    }
    mesher__set_max_vertices(r);
    return MESHER_OK;
}

static void mesher__cavity_free(mesher__cavity *c)
{
    delaunay_release(c->memory, c->tets);
    delaunay_release(c->memory, c->queue);
    delaunay_release(c->memory, c->border);
    delaunay_release(c->memory, c->slots);
    delaunay_release(c->memory, c->facets);
    delaunay_release(c->memory, c->vertices);
    delaunay_release(c->memory, c->hash_key);
    delaunay_release(c->memory, c->hash_value);
}

static void mesher__refiner_free(mesher__refiner *r)
{
    delaunay_handle t;
    int i;
    for (t = 1; t < r->mesh->num_tets; t++) r->mesh->flags[t] &= (uint16_t)~DELAUNAY_STAGE_BITS;
    mesher__cavity_free(&r->cavity);
    for (i = 0; i < r->num_cavities; i++)
        if (r->cavities[i].memory) mesher__cavity_free(r->cavities + i);
    for (i = 0; i < r->num_harvests; i++) {
        delaunay_release(r->memory, r->harvests[i].points);
        mesher__grid_free(&r->harvests[i].grid, r->memory);
    }
    delaunay_release(r->memory, r->harvests);
    delaunay_release(r->memory, r->cavities);
    delaunay_release(r->memory, r->slots);
    delaunay_release(r->memory, r->field.tets);
    delaunay_release(r->memory, r->field.color);
    delaunay_release(r->memory, r->field.vertices);
    mesher__growth_free(r->memory, &r->field.growth);
    delaunay_release(r->memory, r->home);
    delaunay_release(r->memory, r->points);
    delaunay_release(r->memory, r->order);
    delaunay_release(r->memory, r->keys);
    mesher__lattice_free(r);
    mesher__grid_free(&r->grid, r->memory);
}

/* The number of tetrahedra around edge ab of t, which is inside the mesh. */
static int mesher__edge_degree(const delaunay_mesh *mesh, delaunay_handle t, uint32_t a, uint32_t b)
{
    delaunay_handle u = t;
    int n = 0, i, out = -1;
    for (i = 0; i < 4; i++)
        if (mesh->tets[t].v[i] != a && mesh->tets[t].v[i] != b) out = i;
    do { /* leaves u through facet out; the next facet is opposite the vertex that stays then */
        const delaunay_handle h = mesh->tets[u].n[out];
        const uint32_t *v = mesh->tets[h >> 2].v;
        uint32_t stays = 0;
        for (i = 0; i < 4; i++)
            if (i != out && mesh->tets[u].v[i] != a && mesh->tets[u].v[i] != b)
                stays = mesh->tets[u].v[i];
        u = h >> 2;
        for (out = 0; out < 3 && v[out] != stays; out++) {}
        n++;
    } while (u && u != t && n < 1000);
    return n;
}

/* Reports how edge lengths relate to wanted lengths, over edges with an end that refinement added:
 * percentiles by a histogram, and the share from 0.7 to 1.4. It looks at the edges of some ten
 * thousand tetrahedra; each counts for its share of the edge. */
static void mesher__report_sizes(const mesher_domain *domain, mesher_report *report,
                                 uint32_t first_new)
{
    enum { MESHER__BINS = 400 };
    const delaunay_mesh *mesh = &domain->mesh;
    double histogram[MESHER__BINS] = {0}, total = 0, band = 0, sum = 0, *out[3];
    const delaunay_handle step = 1 + mesh->num_tets / 10000;
    delaunay_handle t;
    int e, k, q = 0;
    out[0] = &report->size_p10;
    out[1] = &report->size_p50;
    out[2] = &report->size_p90;
    for (t = 1; t < mesh->num_tets; t += step) {
        if (mesh->num_tets - t > 4 * step)
            for (k = 0; k < 4; k++) {
                MESHER__PREFETCH(mesh->vertices + mesh->tets[t + 4 * step].v[k]);
                MESHER__PREFETCH(domain->size + mesh->tets[t + 4 * step].v[k]);
            }
        if (mesh->num_tets - t > 8 * step) MESHER__PREFETCH(mesh->tets + t + 8 * step);
        if (!mesher__is_inside(mesh, t)) continue;
        for (e = 0; e < 6; e++) {
            uint32_t a = mesh->tets[t].v[delaunay_edge_order(e)[0]],
                     b = mesh->tets[t].v[delaunay_edge_order(e)[1]];
            double l = mesher__distance(mesh->vertices[a].x, mesh->vertices[b].x);
            double ratio = 2 * l / (domain->size[a] + domain->size[b]), share;
            if (a < first_new && b < first_new) continue;
            k = ratio < 4 ? (int)(ratio * 100) : MESHER__BINS - 1;
            share = 1.0 / mesher__edge_degree(mesh, t, a, b);
            histogram[k] += share;
            total += share;
            if (ratio >= 0.7 && ratio <= 1.4) band += share;
        }
    }
    *out[0] = *out[1] = *out[2] = 0;
    report->size_in_band = total > 0 ? band / total : 1;
    for (k = 0; k < MESHER__BINS && q < 3 && total > 0; k++) {
        static const double part[3] = {0.1, 0.5, 0.9};
        sum += histogram[k];
        while (q < 3 && sum >= part[q] * total) *out[q++] = (k + 0.5) / 100;
    }
}

/* -- thin places: where only one layer of tetrahedra fits between two sides of the surface, and
 * they are flat, a point in the middle would make good ones, but it is too near to their corners.
 * So these get smaller sizes, once. Flips may cure some of them without, but not whole patches. */

/* The factor of these sizes. With 0.6 parts of a few thousand tetrahedra get up to 20 % more. */
#define MESHER__NARROW 0.7
/* A tetrahedron is flat if its least height is below so many circumradii, of which a regular one's
 * is 1.33. */
#define MESHER__FLAT 0.45

/* Is tetrahedron t flat, and would there be room for its circumcentre with smaller sizes? */
static int mesher__is_thin(const mesher__refiner *r, delaunay_handle t)
{
    const uint32_t *v = r->mesh->tets[t].v;
    const double *x[4];
    double sum = 0, most = 0, rr, least;
    mesher__proposal p;
    delaunay_handle met;
    int i;
    for (i = 0; i < 4; i++) {
        const double size = r->domain->size[v[i]];
        x[i] = r->mesh->vertices[v[i]].x;
        sum += size;
        if (size > most) most = size;
    }
    rr = mesher__circumcentre(x[0], x[1], x[2], x[3], p.x);
    least = MESHER__NARROW * mesher__bound(sum, most);
    if (!(rr >= least * least) || mesher__least_height(x) >= MESHER__FLAT * sqrt(rr)) return 0;
    p.region = r->mesh->color[t];
    p.home = r->home[v[0]];
    return mesher__settle(r, &p, t, t, &met);
}

/* Makes the sizes in thin places smaller; their tetrahedra will be asked again. *found: whether
 * there are any. Returns 0 without memory. */
static int mesher__narrow(mesher__refiner *r, int *found)
{
    enum { MESHER__ON_SURFACE = 1, MESHER__IS_THIN = 2 };
    delaunay_mesh *mesh = r->mesh;
    const double least = mesher__clamp_size(r->options, mesher__size_floor(mesh));
    uint8_t *at = (uint8_t *)delaunay_alloc_zeroed(r->memory, mesh->num_vertices, 1), all;
    delaunay_handle t;
    uint32_t v;
    int i, k;
    *found = 0;
    if (!at) return 0;
    for (t = 1; t < mesh->num_tets; t++)
        for (i = 0; i < 4 && mesher__is_inside(mesh, t); i++)
            for (k = 1; k < 4 && (mesh->flags[t] & DELAUNAY_FACET_BIT(i)); k++)
                at[mesh->tets[t].v[(i + k) & 3]] = MESHER__ON_SURFACE;
    for (t = 1; t < mesh->num_tets; t++) {
        const uint32_t *corner = mesh->tets[t].v;
        if (!mesher__is_inside(mesh, t)) continue;
        all = at[corner[0]] & at[corner[1]] & at[corner[2]] & at[corner[3]];
        if (!(all & MESHER__ON_SURFACE) || !mesher__is_thin(r, t)) continue;
        for (i = 0; i < 4; i++) at[corner[i]] |= MESHER__IS_THIN;
        mesh->flags[t] &= (uint16_t)~(MESHER__SEEN | MESHER__LOST_MASK);
        *found = 1;
    }
    for (v = 1; v < r->field.num_vertices; v++) {
        double size = MESHER__NARROW * r->domain->size[v];
        if (!(at[v] & MESHER__IS_THIN) || size < least) continue;
        r->domain->size[v] = size;
        r->field.vertices[v].size *= MESHER__NARROW;
        r->field.vertices[v].own *= MESHER__NARROW;
    }
    delaunay_release(r->memory, at);
    return 1;
}

static mesher_result mesher__refine(mesher_domain *domain, mesher_report *report)
{
    mesher__refiner r;
    mesher_result result = MESHER_OK;
    uint32_t first_new;
    uint64_t sweeps = 0;
    int narrowed, found;
    if (!mesher__enter(report, mesher__is_colored(domain))) return MESHER_ERROR_INVALID_ARGUMENT;
    first_new = domain->mesh.num_vertices;
    /* thin places are the caller's if the mesh or the number of layers is */
    narrowed = domain->keeps_mesh || domain->options.layers > 0;
    if (!domain->size || domain->num_sizes != first_new) result = mesher_size(domain, report);
    if (result != MESHER_OK) return result;
    result = mesher__refiner_init(&r, domain);
    if (result == MESHER_OK) result = mesher__lattice(&r, report);
    if (result == MESHER_OK && !mesher__sort_points(&r, 1)) result = mesher__no_memory(&r);
    if (result == MESHER_OK) result = mesher__insert_all(&r, 1);
    while (result == MESHER_OK) {
        if (!mesher__gather(&r) || !mesher__sort_points(&r, 0) || !mesher__filter(&r))
            result = mesher__no_memory(&r);
        if (result == MESHER_OK && r.num_points == 0) {
            if (narrowed) break;
            narrowed = 1;
            if (!mesher__narrow(&r, &found)) result = mesher__no_memory(&r);
            else if (!found) break;
            continue;
        }
        if (result == MESHER_OK) result = mesher__insert_all(&r, 0);
        sweeps++;
    }
    mesher__refiner_free(&r);
    domain->num_sizes = domain->mesh.num_vertices;
    if (report) {
        report->refined_vertices = r.inserted;
        report->refinement_sweeps = sweeps;
        report->size_ignored += r.ignored;
        report->num_tets = r.num_tets;
        mesher__report_sizes(domain, report, first_new);
        report->seconds_refine = delaunay_seconds(&r.options->host) - r.start;
        if (domain->mesh.memory.peak_bytes > report->peak_bytes)
            report->peak_bytes = domain->mesh.memory.peak_bytes;
        if (result == MESHER_STOPPED_BY_BUDGET)
            mesher__say_budget(report, "refinement", r.budget, r.options);
    }
    return result;
}

/* ---- >>public ----------------------------------------------------------------------------- */

MESHER_API const char *mesher_result_string(mesher_result result)
{
    switch (result) {
    case MESHER_OK: return "success";
    case MESHER_STOPPED_BY_BUDGET: return "stopped by a budget; the mesh is valid";
    case MESHER_GOAL_NOT_MET: return "a goal was not met; the mesh is valid";
    case MESHER_ERROR_INVALID_ARGUMENT: return "invalid argument";
    case MESHER_ERROR_OUT_OF_MEMORY: return "out of memory";
    case MESHER_CANCELLED: return "cancelled by the caller";
    case MESHER_ERROR_TOO_LARGE:
        return "too many vertices, triangles or tetrahedra for the index type";
    case MESHER_ERROR_INTERNAL: return "internal error";
    case MESHER_ERROR_SURFACE: return "the surface is invalid";
    case MESHER_ERROR_RECOVERY: return "an edge or facet of the surface could not be recovered";
    }
    return "unknown mesher_result";
}

MESHER_API void mesher_finding_string(char *text, size_t size, const mesher_report *report,
                                      const mesher_finding *finding)
{
    if (text && size && report && finding) mesher__sentence(text, size, report, finding);
}

MESHER_API const char *mesher_kind_string(mesher_kind kind)
{
    switch (kind) {
    case MESHER_NOTE_DUPLICATE_VERTEX: return "duplicate vertex";
    case MESHER_NOTE_UNUSED_VERTEX: return "unused vertex";
    case MESHER_NOTE_REPEATED_INDEX: return "repeated vertex in a triangle or line";
    case MESHER_NOTE_DUPLICATE_TRIANGLE: return "duplicate triangle";
    case MESHER_NOTE_OPPOSITE_TRIANGLE: return "opposite triangle";
    case MESHER_NOTE_FLIPPED_TRIANGLE: return "inconsistent orientation";
    case MESHER_NOTE_OPEN_EDGE: return "open edge";
    case MESHER_NOTE_NON_MANIFOLD_EDGE: return "non-manifold edge";
    case MESHER_NOTE_SHEET: return "sheet inside a cell";
    case MESHER_NOTE_SHELL_FILLED: return "nested shell filled";
    case MESHER_NOTE_SURFACE_STEINER: return "point added to the surface";
    case MESHER_NOTE_NEAR_VERTEX: return "nearly equal vertices";
    case MESHER_NOTE_OUTSIDE_LINE: return "line outside every cell";
    case MESHER_NOTE_OUTSIDE_SEED: return "seed outside every cell";
    case MESHER_NOTE_SHARED_CELL: return "seed in the cell of another";
    case MESHER_NOTE_UNSEEDED_CELL: return "cell without a seed, left out";
    case MESHER_NOTE_OUTSIDE_FACET: return "triangle outside every cell, left out";
    case MESHER_NOTE_CELLS_UNKNOWN: return "cells not known, recovery failed";
    case MESHER_DEFECT_NOT_FINITE: return "coordinate not finite";
    case MESHER_DEFECT_RANGE: return "coordinate out of range";
    case MESHER_DEFECT_INDEX: return "vertex index out of range";
    case MESHER_DEFECT_COLLINEAR: return "collinear triangle";
    case MESHER_DEFECT_T_JUNCTION: return "T-junction";
    case MESHER_DEFECT_OVERLAP: return "overlap";
    case MESHER_DEFECT_INTERSECTION: return "intersection";
    case MESHER_DEFECT_FLAT: return "flat surface";
    case MESHER_DEFECT_NO_CELL: return "no bounded cell";
    case MESHER_DEFECT_NONE_KEPT: return "no cell kept";
    case MESHER_DEFECT_OUTSIDE_FACET: return "facet outside every cell";
    case MESHER_DEFECT_RECOVERY: return "not recovered";
    case MESHER_DEFECT_NOT_IN_MESH: return "not in the mesh";
    case MESHER_NUM_KINDS: break;
    }
    return "unknown mesher_kind";
}

/* A length or ratio that an option may have: finite and not negative. */
static int mesher__sane(double x) { return x >= 0 && x <= DBL_MAX; }

/* Reports an option whose value is not allowed. */
static mesher_result mesher__bad_option(mesher_report *report, const char *name, double value,
                                        const char *wanted)
{
    snprintf(report->message, sizeof report->message,
             "invalid argument: options.%s is %.9g and should be %s", name, value, wanted);
    return MESHER_ERROR_INVALID_ARGUMENT;
}

static mesher_result mesher__check_source(const mesher_options *o, size_t i, mesher_report *report)
{
    const mesher_source *s = o->sources + i;
    const char *member = NULL, *wanted = "finite and 0 or more";
    char name[64];
    double value = 0;
    int k;
    if ((int)s->shape < 0 || s->shape > MESHER_SHAPE_TRIANGLE) {
        member = "shape";
        value = (double)(int)s->shape;
        wanted = "a mesher_shape";
    } else if (!(s->size > 0 && s->size <= DBL_MAX)) {
        member = "size";
        value = s->size;
        wanted = "finite and more than 0";
    } else if (!(s->slope >= 0)) {
        member = "slope";
        value = s->slope;
        wanted = "0 or more";
    } else if (!mesher__sane(s->radius)) {
        member = "radius";
        value = s->radius;
    }
    for (k = 0; k < 9 && !member; k++) {
        if (fabs(s->xyz[k]) <= MESHER__LARGEST_COORDINATE) continue;
        snprintf(name, sizeof name, "sources[%lu].xyz[%d]", (unsigned long)i, k);
        return mesher__bad_option(report, name, s->xyz[k], "within 1e60 of 0");
    }
    if (!member) return MESHER_OK;
    snprintf(name, sizeof name, "sources[%lu].%s", (unsigned long)i, member);
    return mesher__bad_option(report, name, value, wanted);
}

static mesher_result mesher__check_grid(const mesher_size_grid *g, mesher_report *report)
{
    char name[64];
    int k;
    if (!g->size) {
        mesher__say(report, "invalid argument: options.size_grid->size is NULL");
        return MESHER_ERROR_INVALID_ARGUMENT;
    }
    for (k = 0; k < 3; k++) {
        snprintf(name, sizeof name, "size_grid->count[%d]", k);
        if (g->count[k] < 2) return mesher__bad_option(report, name, g->count[k], "2 or more");
        snprintf(name, sizeof name, "size_grid->spacing[%d]", k);
        if (!(g->spacing[k] > 0 && g->spacing[k] <= DBL_MAX))
            return mesher__bad_option(report, name, g->spacing[k], "finite and more than 0");
        snprintf(name, sizeof name, "size_grid->origin[%d]", k);
        if (!(fabs(g->origin[k]) <= DBL_MAX))
            return mesher__bad_option(report, name, g->origin[k], "finite");
    }
    return MESHER_OK;
}

/* Checks that region sizes, sources, the grid and the mesh are as their declarations demand. */
static mesher_result mesher__check_wishes(const mesher_options *o, mesher_report *report)
{
    mesher_result result = MESHER_OK;
    size_t i;
    if (o->num_region_sizes && !o->region_sizes) {
        mesher__say(report,
                    "invalid argument: options.region_sizes is NULL, num_region_sizes not 0");
        return MESHER_ERROR_INVALID_ARGUMENT;
    }
    if (o->num_sources && !o->sources) {
        mesher__say(report, "invalid argument: options.sources is NULL, num_sources not 0");
        return MESHER_ERROR_INVALID_ARGUMENT;
    }
    for (i = 0; i < o->num_sources && result == MESHER_OK; i++)
        result = mesher__check_source(o, i, report);
    if (result == MESHER_OK && o->size_grid) result = mesher__check_grid(o->size_grid, report);
    if (result == MESHER_OK && o->size_mesh && !o->size_mesh->tree) {
        mesher__say(report, "invalid argument: options.size_mesh needs mesher_size_mesh_init");
        return MESHER_ERROR_INVALID_ARGUMENT;
    }
    return result;
}

/* Checks that every number of the options is finite and 0 or more. */
static mesher_result mesher__check_option_numbers(const mesher_options *o, mesher_report *report)
{
    const struct {
        const char *name;
        double value;
    } numbers[9] = {{"size", o->size},
                    {"min_size", o->min_size},
                    {"max_size", o->max_size},
                    {"gradation", o->gradation},
                    {"growth", o->growth},
                    {"max_seconds", o->max_seconds},
                    {"size_factor", o->size_factor},
                    {"layers", o->layers},
                    {"curvature_degrees", o->curvature_degrees}};
    int i;
    for (i = 0; i < 9; i++)
        if (!mesher__sane(numbers[i].value))
            return mesher__bad_option(report, numbers[i].name, numbers[i].value,
                                      "finite and 0 or more");
    return MESHER_OK;
}

/* As mesher_options_resolve; the report's message says what is wrong. */
static mesher_result mesher__resolve(mesher_options *out, const mesher_options *in,
                                     mesher_report *report)
{
    mesher_options o;
    if (in) o = *in;
    else memset(&o, 0, sizeof o);
    if (!o.host.allocator.alloc != !o.host.allocator.release) {
        mesher__say(report, "invalid argument: of options.host.allocator.alloc and release one is "
                            "NULL, and one is not");
        return MESHER_ERROR_INVALID_ARGUMENT;
    }
    if (o.host.num_threads < 0)
        return mesher__bad_option(report, "host.num_threads", o.host.num_threads, "0 or more");
    if ((int)o.regions < 0 || o.regions > MESHER_REGIONS_SEEDS)
        return mesher__bad_option(report, "regions", (double)(int)o.regions, "a mesher_regions");
    if (mesher__check_option_numbers(&o, report) != MESHER_OK) return MESHER_ERROR_INVALID_ARGUMENT;
    if (mesher__check_wishes(&o, report) != MESHER_OK) return MESHER_ERROR_INVALID_ARGUMENT;
    if (o.max_size > 0 && o.min_size > o.max_size)
        return mesher__bad_option(report, "min_size", o.min_size, "no more than max_size");
    if (o.gradation != 0 && o.gradation < 1)
        return mesher__bad_option(report, "gradation", o.gradation, "0, or 1 or more");
    if (o.growth != 0 && o.growth <= 1)
        return mesher__bad_option(report, "growth", o.growth, "0, or more than 1");
    if (o.growth > MESHER__MOST_GROWTH) o.growth = MESHER__MOST_GROWTH;
    if (o.size_factor == 0) o.size_factor = 1;
    *out = o;
    return MESHER_OK;
}

MESHER_API mesher_result mesher_options_resolve(mesher_options *out, const mesher_options *in)
{
    mesher_report unused;
    return out ? mesher__resolve(out, in, &unused) : MESHER_ERROR_INVALID_ARGUMENT;
}

static mesher_result mesher__check_arguments(const mesher_surface *s, mesher_report *report)
{
    const char *missing = s->num_vertices && !s->xyz             ? "xyz"
                          : s->num_triangles && !s->triangles    ? "triangles"
                          : s->num_edges && !s->edges            ? "edges"
                          : s->num_seeds && !s->seeds            ? "seeds"
                                                                 : NULL;
    size_t most = UINT32_MAX - 16, i;
    if (missing) {
        snprintf(report->message, sizeof report->message,
                 "invalid argument: surface.%s is NULL, their number not 0", missing);
        return MESHER_ERROR_INVALID_ARGUMENT;
    }
    if (s->num_vertices > most - 8 || s->num_triangles > most / 3 ||
        s->num_edges > most / 3 - s->num_triangles)
        return MESHER_ERROR_TOO_LARGE;
    if (s->num_seeds > most / 3) return MESHER_ERROR_TOO_LARGE;
    for (i = 0; i < 3 * s->num_seeds; i++)
        if (!(fabs(s->seeds[i]) <= MESHER__LARGEST_COORDINATE)) {
            snprintf(report->message, sizeof report->message,
                     "invalid argument: a coordinate of seed %lu is %.9g and should be within 1e60 "
                     "of 0", (unsigned long)(i / 3), s->seeds[i]);
            return MESHER_ERROR_INVALID_ARGUMENT;
        }
    return MESHER_OK;
}

/* Fills vertex_used. Vertices of the caller's tetrahedra (num_tets of them, or 0) are not noted as
 * unused. */
static mesher_result mesher__sort_vertices(mesher_domain *domain, const uint32_t *tets,
                                           size_t num_tets, mesher_report *report)
{
    mesher_result result;
    uint8_t *in_tets = NULL;
    size_t n = domain->surface.num_vertices, i;
    int k;
    mesher__find_uses(domain, report);
    if (num_tets) {
        in_tets = (uint8_t *)delaunay_alloc_zeroed(&domain->memory, n, 1);
        if (!in_tets) return MESHER_ERROR_OUT_OF_MEMORY;
    }
    for (i = 0; i < num_tets; i++)
        for (k = 0; k < 4; k++)
            if (tets[4 * i + (size_t)k] < n) in_tets[domain->survivor[tets[4 * i + (size_t)k]]] = 1;
    result = mesher__place_isolated(domain, in_tets, report);
    delaunay_release(&domain->memory, in_tets);
    return result;
}

/* As mesher_domain_init, but a failed domain is not freed. *usable: the intersection test can work
 * on the domain, even if there are defects. tets: the caller's, if there are any. */
static mesher_result mesher__domain_init(mesher_domain *domain, const mesher_surface *surface,
                                         const uint32_t *tets, size_t num_tets,
                                         const mesher_options *options, mesher_report *report,
                                         int *usable)
{
    delaunay_memory *memory = &domain->memory;
    mesher_result result;
    size_t n = surface->num_vertices;
    *usable = 0;
    result = mesher__resolve(&domain->options, options, report);
    if (result != MESHER_OK) return result;
    result = (mesher_result)delaunay_memory_init(memory, &domain->options.host);
    if (result == MESHER_OK) result = mesher__check_arguments(surface, report);
    if (result != MESHER_OK) return result;
    if (mesher__progress(&domain->options, "surface", 0)) return MESHER_CANCELLED;
    domain->surface = *surface;
    domain->first_corner = (uint32_t)n;
    if (mesher__check_numbers(surface, report)) return MESHER_ERROR_SURFACE;
    domain->survivor = (uint32_t *)delaunay_alloc(memory, n, sizeof *domain->survivor);
    domain->vertex_used = (uint8_t *)delaunay_alloc(memory, n, 1);
    if (!domain->survivor || !domain->vertex_used) return MESHER_ERROR_OUT_OF_MEMORY;
    result = mesher__weld(domain);
    if (result == MESHER_OK) result = mesher__find_facets(domain, report);
    if (result == MESHER_OK) result = mesher__find_edges(domain, report);
    if (result != MESHER_OK) return result;
    result = mesher__sort_vertices(domain, tets, num_tets, report);
    if (result == MESHER_OK) result = mesher__check_cells(domain, report);
    if (result != MESHER_OK) return result;
    *usable = 1;
    domain->stage = MESHER__STAGE_INIT;
    return mesher__count_defects(report) ? MESHER_ERROR_SURFACE : MESHER_OK;
}

MESHER_API mesher_result mesher_domain_init(mesher_domain *domain, const mesher_surface *surface,
                                            const mesher_options *options, mesher_report *report)
{
    mesher_report local;
    mesher_result result;
    int usable;
    if (domain) memset(domain, 0, sizeof *domain);
    if (!domain || !surface) return mesher__refuse(report);
    memset(&local, 0, sizeof local);
    if (!report) report = &local;
    mesher__report_reset(report, surface);
    result = mesher__domain_init(domain, surface, NULL, 0, options, report, &usable);
    if (result == MESHER_ERROR_SURFACE) mesher__message_finish(report);
    mesher__message_failure(report, result);
    if (result != MESHER_OK) mesher_domain_free(domain);
    return result;
}

MESHER_API void mesher_domain_free(mesher_domain *domain)
{
    delaunay_memory *memory;
    if (!domain) return;
    memory = &domain->memory;
    if (memory->allocator.release) {
        delaunay_release(memory, domain->facets);
        delaunay_release(memory, domain->facet_source);
        delaunay_release(memory, domain->edges);
        delaunay_release(memory, domain->edge_source);
        delaunay_release(memory, domain->survivor);
        delaunay_release(memory, domain->vertex_used);
        delaunay_release(memory, domain->size);
        delaunay_release(memory, domain->own_size);
        delaunay_release(memory, domain->size_source);
        delaunay_release(memory, domain->regions);
        delaunay_release(memory, domain->facet_sides);
    }
    delaunay_mesh_free(&domain->mesh);
    memset(domain, 0, sizeof *domain);
}

/* Meshes a surface in which no defect was found, without refinement: what its cells alone tell. If
 * recovery fails, that is not known. */
static mesher_result mesher__mesh_to_check(mesher_domain *domain, mesher_report *report)
{
    mesher_report scratch;
    mesher_result result;
    memset(&scratch, 0, sizeof scratch);
    mesher__report_reset(&scratch, &domain->surface);
    domain->options.allow_surface_steiner = 1; /* points on the surface change no cell */
    result = mesher_empty_mesh(domain, &scratch);
    if (result >= 0) result = mesher_recover(domain, &scratch);
    if (result >= 0) return mesher_color(domain, report);
    if (result != MESHER_ERROR_SURFACE && result != MESHER_ERROR_RECOVERY) return result;
    mesher_report_add(report, MESHER_NOTE_CELLS_UNKNOWN, DELAUNAY_NO_ID, DELAUNAY_NO_ID,
                      DELAUNAY_NO_ID, DELAUNAY_NO_ID, DELAUNAY_NO_ID, NULL);
    return MESHER_OK;
}

/* May there be facets outside every cell, or cells none of which is kept? Where all edges have two
 * facets, each facet has a bounded cell on one side. */
static int mesher__needs_cells(const mesher_domain *domain, const mesher_report *report)
{
    return report->counts[MESHER_NOTE_OPEN_EDGE] || report->counts[MESHER_NOTE_NON_MANIFOLD_EDGE] ||
           domain->options.regions == MESHER_REGIONS_WINDING ||
           domain->options.regions == MESHER_REGIONS_SEEDS;
}

MESHER_API mesher_result mesher_check(const mesher_surface *surface, const mesher_options *options,
                                      mesher_report *report)
{
    mesher_domain domain;
    mesher_report local;
    mesher_result result;
    double start;
    int usable = 0;
    if (!surface) return mesher__refuse(report);
    memset(&domain, 0, sizeof domain);
    memset(&local, 0, sizeof local);
    if (!report) report = &local;
    start = delaunay_seconds(options ? &options->host : NULL);
    mesher__report_reset(report, surface);
    result = mesher__domain_init(&domain, surface, NULL, 0, options, report, &usable);
    if (usable && !domain.options.no_intersection_test)
        result = mesher__check_space(&domain, report);
    if (result == MESHER_OK && !domain.options.no_intersection_test &&
        mesher__needs_cells(&domain, report))
        result = mesher__mesh_to_check(&domain, report);
    mesher__message_finish(report);
    mesher__message_failure(report, result);
    report->seconds_check = delaunay_seconds(options ? &options->host : NULL) - start;
    report->peak_bytes = domain.memory.peak_bytes + domain.mesh.memory.peak_bytes;
    mesher_domain_free(&domain);
    return result;
}

MESHER_API mesher_result mesher_weld(double *xyz, size_t num_vertices, double distance,
                                     const delaunay_host *host, uint64_t *num_moved)
{
    delaunay_memory memory;
    mesher__near_grid grid;
    mesher_result result;
    uint64_t moved = 0;
    uint32_t v, onto;
    if (num_moved) *num_moved = 0;
    if ((num_vertices && !xyz) || !(distance >= MESHER__SMALLEST_EXTENT && distance <= DBL_MAX))
        return MESHER_ERROR_INVALID_ARGUMENT;
    if (num_vertices >= DELAUNAY_NO_ID) return MESHER_ERROR_TOO_LARGE;
    result = (mesher_result)delaunay_memory_init(&memory, host);
    if (result != MESHER_OK || num_vertices == 0) return result;
    result = mesher__near_init(&grid, &memory, xyz, num_vertices, num_vertices, distance);
    for (v = 0; v < num_vertices && result == MESHER_OK; v++) {
        double *x = xyz + 3 * (size_t)v;
        if (!(fabs(x[0]) <= MESHER__LARGEST_COORDINATE &&
              fabs(x[1]) <= MESHER__LARGEST_COORDINATE && fabs(x[2]) <= MESHER__LARGEST_COORDINATE))
            continue;
        onto = mesher__near_or_add(&grid, v);
        if (onto == DELAUNAY_NO_ID) continue;
        moved += !mesher__is_near(x, xyz + 3 * (size_t)onto, 0);
        memcpy(x, xyz + 3 * (size_t)onto, 3 * sizeof *x);
    }
    mesher__near_free(&grid, &memory);
    if (num_moved) *num_moved = moved;
    return result;
}

/* Takes the defects out of a report; notes stay. */
static void mesher__report_drop_defects(mesher_report *report)
{
    size_t i, n = 0;
    int k;
    for (i = 0; i < report->num_findings; i++)
        if (!mesher_is_defect(report->findings[i].kind))
            report->findings[n++] = report->findings[i];
    report->num_findings = n;
    for (k = MESHER_DEFECT_FIRST; k < MESHER_NUM_KINDS; k++) report->counts[k] = 0;
    report->message[0] = 0;
}

/* The intersection test after a failed recovery. Its defects replace those that recovery reported;
 * if it finds none, the surface is valid, and the result is that of recovery. */
static mesher_result mesher__explain_failure(mesher_domain *domain, mesher_report *report,
                                             mesher_result failure)
{
    delaunay_memory *memory = &domain->memory;
    double start = delaunay_seconds(&domain->options.host);
    mesher_report found;
    mesher_result result;
    size_t i;
    int k;
    if (domain->is_checked) return failure; /* the findings are in the report */
    memset(&found, 0, sizeof found);
    found.findings =
        (mesher_finding *)delaunay_alloc(memory, report->cap_findings, sizeof *found.findings);
    if (!found.findings) return failure;
    found.cap_findings = report->cap_findings;
    mesher__report_reset(&found, &domain->surface);
    result = mesher__check_space(domain, &found);
    report->seconds_check += delaunay_seconds(&domain->options.host) - start;
    if (result == MESHER_ERROR_SURFACE) {
        mesher__report_drop_defects(report);
        for (i = 0; i < found.num_findings; i++) mesher__add_finding(report, found.findings + i);
        for (k = 0; k < MESHER_NUM_KINDS; k++) /* also those that there was no room for */
            if (mesher_is_defect((mesher_kind)k)) report->counts[k] = found.counts[k];
        memcpy(report->message, found.message, sizeof report->message);
        mesher__message_finish(report);
        failure = result;
    } else if (result == MESHER_CANCELLED) {
        failure = result;
    }
    delaunay_release(memory, found.findings);
    return failure;
}

/* The stages up to a valid mesh with regions. */
static mesher_result mesher__mesh_surface(mesher_domain *domain, mesher_report *report)
{
    mesher_result result;
    if (mesher__progress(&domain->options, "empty mesh", 0)) return MESHER_CANCELLED;
    result = mesher_empty_mesh(domain, report);
    if (result < 0) return result;
    if (mesher__progress(&domain->options, "recover", 0)) return MESHER_CANCELLED;
    result = mesher_recover(domain, report);
    if (result == MESHER_ERROR_RECOVERY || result == MESHER_ERROR_SURFACE)
        return mesher__explain_failure(domain, report, result);
    if (result < 0) return result;
    if (mesher__progress(&domain->options, "regions", 0)) return MESHER_CANCELLED;
    result = mesher_color(domain, report);
    if (result == MESHER_ERROR_SURFACE) mesher__message_finish(report);
    return result;
}

/* The stages that bring it to the wanted sizes. */
static mesher_result mesher__mesh_size(mesher_domain *domain, mesher_report *report)
{
    mesher_result result;
    if (mesher__progress(&domain->options, "size", 0)) return MESHER_CANCELLED;
    result = mesher_size(domain, report);
    if (result < 0) return result;
    if (mesher__progress(&domain->options, "refine", 0)) return MESHER_CANCELLED;
    return mesher__refine(domain, report);
}

/* What mesher_refine_surface does, or only its flips. */
static mesher_result mesher__change_surface(mesher_fine_surface *fine,
                                            const mesher_surface *surface,
                                            const mesher_options *options, int only_flips,
                                            mesher_report *report)
{
    mesher_domain domain;
    mesher__divider divider;
    mesher_report local;
    mesher_result result;
    double start;
    if (!fine) return mesher__refuse(report);
    memset(fine, 0, sizeof *fine);
    memset(&divider, 0, sizeof divider);
    memset(&local, 0, sizeof local);
    divider.only_flips = only_flips;
    if (!report) report = &local;
    start = delaunay_seconds(options ? &options->host : NULL);
    result = mesher_domain_init(&domain, surface, options, report);
    report->seconds_check = delaunay_seconds(options ? &options->host : NULL) - start;
    if (result != MESHER_OK) return result;
    result = mesher__mesh_surface(&domain, report);
    if (result >= 0 && !only_flips) {
        result = mesher__find_sizes(&domain, 0, report);
        if (result >= 0 && !mesher__has_numbers(&domain, "surface", report))
            result = MESHER_ERROR_TOO_LARGE;
    }
    if (result >= 0)
        result = (mesher_result)delaunay_memory_init(&fine->memory, &domain.options.host);
    if (result >= 0) {
        result = mesher__divide_surface(fine, &domain, &divider);
        mesher__divider_free(&divider);
    }
    if (result == MESHER_STOPPED_BY_BUDGET)
        mesher__say_budget(report, "division", divider.budget, &domain.options);
    report->peak_bytes =
        domain.memory.peak_bytes + domain.mesh.memory.peak_bytes + fine->memory.peak_bytes;
    mesher_domain_free(&domain);
    if (result < 0) mesher_fine_surface_free(fine);
    mesher__message_failure(report, result);
    return result;
}

MESHER_API mesher_result mesher_refine_surface(mesher_fine_surface *fine,
                                               const mesher_surface *surface,
                                               const mesher_options *options,
                                               mesher_report *report)
{
    return mesher__change_surface(fine, surface, options, 0, report);
}

MESHER_API mesher_result mesher_flip_surface(mesher_fine_surface *fine,
                                             const mesher_surface *surface,
                                             const mesher_options *options, mesher_report *report)
{
    return mesher__change_surface(fine, surface, options, 1, report);
}

MESHER_API mesher_result mesher_count_flips(mesher_domain *domain, uint64_t *count)
{
    mesher_fine_surface fine;
    mesher__divider divider;
    mesher_result result;
    size_t i;
    if (!domain || !count || domain->surface.num_triangles == 0)
        return MESHER_ERROR_INVALID_ARGUMENT;
    *count = 0;
    memset(&fine, 0, sizeof fine);
    memset(&divider, 0, sizeof divider);
    divider.only_flips = 1;
    result = (mesher_result)delaunay_memory_init(&fine.memory, &domain->options.host);
    if (result == MESHER_OK) {
        result = mesher__divider_init(&divider, domain, &fine);
        for (i = 0; i < 3 * divider.num && result == MESHER_OK; i++)
            *count += divider.next[i] > i && mesher__is_to_flip(&divider, (uint32_t)i);
        mesher__divider_free(&divider);
    }
    mesher_fine_surface_free(&fine);
    return result;
}

/* The mesh's tetrahedron slots are divided into blocks, which threads share; slot 0 is in none. The
 * function returns the first slot of block b; b = MESHER__OUTPUT_BLOCKS: the end of all. */
enum { MESHER__OUTPUT_BLOCKS = 256 };
static delaunay_handle mesher__output_block(const delaunay_mesh *mesh, int b)
{
    uint64_t slots = mesh->num_tets ? mesh->num_tets - 1 : 0;
    return (delaunay_handle)(1 + slots * (uint64_t)b / MESHER__OUTPUT_BLOCKS);
}

/* Sets the keys of the vertices of a block's kept tetrahedra to 0; threads may set the same key.
 * Returns how many tetrahedra are kept. */
static uint64_t mesher__mark_output(const delaunay_mesh *mesh, int b)
{
    delaunay_handle t = mesher__output_block(mesh, b), end = mesher__output_block(mesh, b + 1);
    uint64_t kept = 0;
    int i;
    for (; t < end; t++) {
        if (!mesher__is_inside(mesh, t)) continue;
        kept++;
        for (i = 0; i < 4; i++) {
            uint32_t *key = &mesh->vertices[mesh->tets[t].v[i]].key;
            if (MESHER__FETCH(key) != 0) MESHER__STORE(key, 0);
        }
    }
    return kept;
}

/* Sets vertices[].key of every vertex of a kept tetrahedron to its output number, and NO_ID for the
 * others. Input vertices keep their number (the survivor's), new ones follow in the order of the
 * array. Returns the number of output vertices. before[b]: number of kept tetrahedra before block
 * b; the last entry: of all. */
static uint32_t mesher__number_output(mesher_domain *domain, uint64_t *before)
{
    delaunay_mesh *mesh = &domain->mesh;
    int threads = delaunay_threads_for(&domain->options.host, mesh->num_tets), b;
    uint32_t next = domain->first_corner;
    int64_t v, num = (int64_t)mesh->num_vertices;
    (void)threads;
    MESHER__OMP(omp parallel for schedule(static) num_threads(threads))
    for (v = 0; v < num; v++) mesh->vertices[v].key = DELAUNAY_NO_ID;
    MESHER__OMP(omp parallel for schedule(dynamic, 4) num_threads(threads))
    for (b = 0; b < MESHER__OUTPUT_BLOCKS; b++) before[b + 1] = mesher__mark_output(mesh, b);
    for (before[0] = 0, b = 0; b < MESHER__OUTPUT_BLOCKS; b++) before[b + 1] += before[b];
    for (v = 1; v < num; v++)
        if (mesh->vertices[v].key == 0)
            mesh->vertices[v].key = mesh->vertex_id[v] == DELAUNAY_NO_ID
                                        ? next++
                                        : domain->survivor[mesh->vertex_id[v]];
    return next;
}

static void mesher__count_output(mesher_domain *domain, mesher_report *report)
{
    uint64_t before[MESHER__OUTPUT_BLOCKS + 1];
    report->num_vertices = mesher__number_output(domain, before);
    report->num_tets = before[MESHER__OUTPUT_BLOCKS];
}

/* Ends a call that makes a domain: after an error nothing is left of it. */
static mesher_result mesher__end(mesher_domain *domain, mesher_report *report,
                                 mesher_result result)
{
    if (result < 0) {
        mesher_domain_free(domain);
        mesher__message_failure(report, result);
        report->num_vertices = report->num_tets = 0;
        return result;
    }
    if (result == MESHER_OK) report->message[0] = 0;
    mesher__count_output(domain, report);
    return result;
}

MESHER_API mesher_result mesher_refine(mesher_domain *domain, mesher_report *report)
{
    mesher_result result = mesher__refine(domain, report);
    if (result >= 0 && report && domain->survivor) /* there is a surface */
        mesher__count_output(domain, report);
    return result;
}

MESHER_API mesher_result mesher_mesh(mesher_domain *domain, const mesher_surface *surface,
                                     const mesher_options *options, mesher_report *report)
{
    mesher_report local;
    mesher_result result;
    double start;
    int usable;
    if (domain) memset(domain, 0, sizeof *domain);
    if (!domain || !surface) return mesher__refuse(report);
    memset(&local, 0, sizeof local);
    if (!report) report = &local;
    start = delaunay_seconds(options ? &options->host : NULL);
    mesher__report_reset(report, surface);
    result = mesher__domain_init(domain, surface, NULL, 0, options, report, &usable);
    if (result == MESHER_ERROR_SURFACE && usable && !domain->options.no_intersection_test)
        result = mesher__check_space(domain, report); /* report all defects at once */
    report->seconds_check = delaunay_seconds(options ? &options->host : NULL) - start;
    if (result == MESHER_ERROR_SURFACE) mesher__message_finish(report);
    if (result >= 0) result = mesher__mesh_surface(domain, report);
    if (result >= 0 && !domain->options.no_refine) result = mesher__mesh_size(domain, report);
    report->peak_bytes = domain->memory.peak_bytes + domain->mesh.memory.peak_bytes;
    return mesher__end(domain, report, result);
}

/* -- a small part of a surface that fails like the whole: mesher_reproduce */

enum { MESHER__PART_TRIANGLES = 4096, MESHER__PART_RUNS = 100, MESHER__PART_SECONDS = 30 };

typedef struct mesher__part {
    const mesher_surface *whole;
    mesher_options  options;
    mesher_result   failure;    /* the whole's: the part has to fail in the same way */
    delaunay_memory memory;
    uint64_t *
        order; /* of the whole's triangles, nearest first: distance<<32|triangle */
    uint32_t *chosen, *trial;   /* triangles of the whole */
    uint32_t *number;           /* whole's vertex -> its index in the part plus 1; 0: none */
    double   *xyz;
    uint32_t *triangles;
    mesher_surface *out;
    delaunay_host   host;       /* the caller's */
    double          start;
    int             runs, late; /* late: the time is up */
} mesher__part;

static double mesher__part_clock(void *user)
{
    const mesher__part *p = (const mesher__part *)user;
    return p->host.clock(p->host.user);
}

/* The progress callback of the runs: cancels one that the caller cancels, or if the time is up. */
static int mesher__part_progress(void *user, const char *phase, double done)
{
    mesher__part *p = (mesher__part *)user;
    if (p->host.progress && p->host.progress(p->host.user, phase, done)) return 1;
    p->late = delaunay_seconds(&p->host) > p->start + (double)MESHER__PART_SECONDS;
    return p->late;
}

/* The distance of a place from the bounding box of triangle t. */
static double mesher__triangle_box_distance(const mesher_surface *s, size_t t, const double *where)
{
    double sum = 0;
    int k, j;
    for (k = 0; k < 3; k++) {
        double lo = HUGE_VAL, hi = -HUGE_VAL, d = 0;
        for (j = 0; j < 3; j++) {
            double x = s->xyz[3 * (size_t)s->triangles[3 * t + (size_t)j] + (size_t)k];
            if (x < lo) lo = x;
            if (x > hi) hi = x;
        }
        if (where[k] < lo) d = lo - where[k];
        if (where[k] > hi) d = where[k] - hi;
        sum += d * d;
    }
    return sqrt(sum);
}

static void mesher__part_order(mesher__part *p, const double *where)
{
    size_t i, n = p->whole->num_triangles;
    double distant = 0;
    for (i = 0; i < n; i++) {
        double d = mesher__triangle_box_distance(p->whole, i, where);
        if (d > distant) distant = d;
    }
    for (i = 0; i < n; i++) {
        double d = distant > 0 ? mesher__triangle_box_distance(p->whole, i, where) / distant : 0;
        if (!(d <= 1)) d = 1; /* not finite: it comes last */
        p->order[i] = (uint64_t)(d * 4294967295.0) << 32 | i;
    }
    if (n > 1) qsort(p->order, n, sizeof *p->order, mesher__compare_u64);
}

/* Makes the part of the chosen triangles of the whole and a box around them. */
static void mesher__part_build(mesher__part *p, const uint32_t *chosen, size_t count)
{
    static const uint8_t faces[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6},
                                         {0, 1, 4}, {1, 5, 4}, {2, 6, 3}, {3, 6, 7},
                                         {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    double lo[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, hi[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL},
           room = 0;
    size_t i, n = 0;
    int k;
    for (i = 0; i < 3 * count; i++)
        p->number[p->whole->triangles[3 * (size_t)chosen[i / 3] + i % 3]] = 0;
    for (i = 0; i < 3 * count; i++) {
        uint32_t v = p->whole->triangles[3 * (size_t)chosen[i / 3] + i % 3];
        if (!p->number[v]) {
            memcpy(p->xyz + 3 * n, p->whole->xyz + 3 * (size_t)v, 3 * sizeof *p->xyz);
            p->number[v] = (uint32_t)++n;
        }
        p->triangles[i] = p->number[v] - 1;
    }
    for (i = 0; i < 3 * n; i++) {
        if (p->xyz[i] < lo[i % 3]) lo[i % 3] = p->xyz[i];
        if (p->xyz[i] > hi[i % 3]) hi[i % 3] = p->xyz[i];
    }
    for (k = 0; k < 3; k++)
        if (hi[k] - lo[k] > room) room = hi[k] - lo[k];
    for (i = 0; i < 24; i++)
        p->xyz[3 * n + i] = i / 3 >> i % 3 & 1 ? hi[i % 3] + room : lo[i % 3] - room;
    for (i = 0; i < 36; i++) p->triangles[3 * count + i] = (uint32_t)n + faces[i / 3][i % 3];
    memset(p->out, 0, sizeof *p->out);
    p->out->xyz = p->xyz;
    p->out->num_vertices = n + 8;
    p->out->triangles = p->triangles;
    p->out->num_triangles = count + 12;
}

/* Does the part with these triangles fail like the whole? Negative: cancelled, or out of memory. */
static int mesher__part_fails(mesher__part *p, const uint32_t *chosen, size_t count)
{
    mesher_domain domain;
    mesher_result result;
    mesher__part_build(p, chosen, count);
    p->runs++;
    memset(&domain, 0, sizeof domain);
    result = mesher_mesh(&domain, p->out, &p->options, NULL);
    mesher_domain_free(&domain);
    if (result == MESHER_CANCELLED && p->late) return 0;
    if (result == MESHER_CANCELLED || result == MESHER_ERROR_OUT_OF_MEMORY) return (int)result;
    return result == p->failure;
}

static int mesher__part_is_done(const mesher__part *p)
{
    return p->late || p->runs >= MESHER__PART_RUNS;
}

/* Removes pieces of the list of chosen triangles, large ones first, wherever the rest still fails.
 * Returns 1, or a failure. */
static int mesher__part_shrink(mesher__part *p, size_t *count)
{
    size_t piece, i, n;
    int fails;
    for (piece = (*count + 1) / 2; piece > 0 && !mesher__part_is_done(p);
         piece = piece > 1 ? (piece + 1) / 2 : 0)
        for (i = 0; i < *count && !mesher__part_is_done(p);) {
            size_t end = i + piece < *count ? i + piece : *count;
            n = i;
            memcpy(p->trial, p->chosen, i * sizeof *p->trial);
            memcpy(p->trial + i, p->chosen + end, (*count - end) * sizeof *p->trial);
            n += *count - end;
            fails = n > 0 ? mesher__part_fails(p, p->trial, n) : 0;
            if (fails < 0) return fails;
            if (!fails) {
                i = end;
                continue;
            }
            memcpy(p->chosen, p->trial, n * sizeof *p->trial);
            *count = n;
        }
    return 1;
}

static mesher_result mesher__part_find(mesher__part *p)
{
    size_t all = p->whole->num_triangles, n, i;
    int fails = 0;
    for (n = 8; fails == 0; n *= 2) {
        if (n > all) n = all;
        for (i = 0; i < n; i++) p->chosen[i] = (uint32_t)p->order[i];
        fails = mesher__part_fails(p, p->chosen, n);
        if (n == all || n >= MESHER__PART_TRIANGLES || fails || p->late) break;
    }
    if (fails > 0) fails = mesher__part_shrink(p, &n);
    mesher__part_build(p, p->chosen, n);
    return fails < 0 ? (mesher_result)fails : fails ? MESHER_OK : MESHER_GOAL_NOT_MET;
}

MESHER_API mesher_result mesher_reproduce(const mesher_surface *surface,
                                          const mesher_options *options, mesher_result failure,
                                          const double *where, double *xyz, uint32_t *triangles,
                                          mesher_surface *part)
{
    mesher__part p;
    mesher_report unused;
    mesher_result result;
    size_t i;
    if (!surface || !surface->num_triangles || !where || !xyz || !triangles || !part ||
        failure >= 0)
        return MESHER_ERROR_INVALID_ARGUMENT;
    result = mesher__check_arguments(surface, &unused);
    if (result != MESHER_OK) return result;
    for (i = 0; i < 3; i++)
        if (!(fabs(where[i]) <= DBL_MAX)) return MESHER_ERROR_INVALID_ARGUMENT;
    for (i = 0; i < 3 * surface->num_triangles; i++)
        if (surface->triangles[i] >= surface->num_vertices) return MESHER_ERROR_INVALID_ARGUMENT;
    memset(&p, 0, sizeof p);
    result = mesher_options_resolve(&p.options, options);
    if (result == MESHER_OK)
        result = (mesher_result)delaunay_memory_init(&p.memory, &p.options.host);
    if (result != MESHER_OK) return result;
    p.whole = surface;
    p.failure = failure;
    p.xyz = xyz;
    p.triangles = triangles;
    p.out = part;
    p.options.no_refine = 1;
    p.options.regions = MESHER_REGIONS_ALL;
    p.host = p.options.host;
    p.options.host.log = NULL;
    p.options.host.progress = mesher__part_progress;
    if (p.host.clock) p.options.host.clock = mesher__part_clock;
    p.options.host.user = &p;
    p.start = delaunay_seconds(&p.host);
    p.order = (uint64_t *)delaunay_alloc(&p.memory, surface->num_triangles, sizeof *p.order);
    p.chosen = (uint32_t *)delaunay_alloc(&p.memory, surface->num_triangles, sizeof *p.chosen);
    p.trial = (uint32_t *)delaunay_alloc(&p.memory, surface->num_triangles, sizeof *p.trial);
    p.number = (uint32_t *)delaunay_alloc(&p.memory, surface->num_vertices, sizeof *p.number);
    result = MESHER_ERROR_OUT_OF_MEMORY;
    if (p.order && p.chosen && p.trial && p.number) {
        mesher__part_order(&p, where);
        result = mesher__part_find(&p);
    }
    delaunay_release(&p.memory, p.order);
    delaunay_release(&p.memory, p.chosen);
    delaunay_release(&p.memory, p.trial);
    delaunay_release(&p.memory, p.number);
    return result;
}

/* -- a mesh of the caller's: mesher_refine_mesh */

/* Marks facet f and its edges as constrained. */
static mesher_result mesher__keep_facet(delaunay_mesh *mesh, delaunay_worker *worker,
                                        delaunay_handle f)
{
    const uint8_t *order = delaunay_facet_order((int)(f & 3));
    int i;
    delaunay_mark_facet(mesh, f, 1);
    for (i = 0; i < 3; i++) {
        const uint32_t *v = mesh->tets[f >> 2].v;
        mesher_result result = (mesher_result)delaunay_mark_edge(mesh, worker, f >> 2, v[order[i]],
                                                                 v[order[(i + 1) % 3]], 1);
        if (result != MESHER_OK) return result;
    }
    return MESHER_OK;
}

/* Marks the surface's facets and edges of tetrahedron t as constrained and sets their flags in seen
 * (all edges, then all facets). They are looked up by their vertices, tetrahedron by tetrahedron,
 * not from star to star: where parts of the mesh touch only in a vertex or an edge, the star of
 * this is not connected. */
static void mesher__keep_in(const mesher_domain *domain, delaunay_handle t, uint8_t *seen)
{
    const delaunay_mesh *mesh = &domain->mesh;
    uint32_t id[4], w[3], place;
    unsigned flags = 0;
    int i, j;
    for (i = 0; i < 4; i++) {
        id[i] = domain->survivor[mesh->vertex_id[mesh->tets[t].v[i]]];
        if (domain->vertex_used[id[i]] != MESHER_VERTEX_SURFACE) id[i] = DELAUNAY_NO_ID;
    }
    for (i = 0; i < 6; i++) {
        const uint8_t *o = delaunay_edge_order(i);
        if (id[o[0]] == DELAUNAY_NO_ID || id[o[1]] == DELAUNAY_NO_ID) continue;
        place = mesher__edge_find(domain, id[o[0]], id[o[1]]);
        if (place == DELAUNAY_NO_ID) continue;
        seen[place] = 1;
        flags |= DELAUNAY_EDGE_BIT(i);
    }
    for (i = 0; i < 4; i++) {
        if (mesher__facet_edges(i) & ~flags) continue;
        for (j = 0; j < 3; j++) w[j] = id[delaunay_facet_order(i)[j]];
        (void)mesher__ascend(w);
        place = mesher__facet_find(domain, w);
        if (place == DELAUNAY_NO_ID) continue;
        seen[(size_t)domain->num_edges + place] = 1;
        flags |= DELAUNAY_FACET_BIT(i);
    }
    mesh->flags[t] = (uint16_t)(mesh->flags[t] | flags);
}

/* Marks as constrained the facets of the border and between regions, with their edges, and all
 * facets and lines of the surface, which must be in the mesh. seen: a zero for each edge and facet.
 * Where the star of an edge is not connected, each part of it has facets of the border, by which
 * the edge is marked in all parts. */
static mesher_result mesher__keep_surface(mesher_domain *domain, delaunay_worker *worker,
                                          uint8_t *seen, mesher_report *report)
{
    delaunay_mesh *mesh = &domain->mesh;
    mesher_result result = MESHER_OK;
    delaunay_handle t;
    uint32_t k;
    int i;
    for (t = 1; t < mesh->num_tets; t++)
        for (i = 0; i < 4; i++) {
            delaunay_handle n = mesh->tets[t].n[i] >> 2;
            if (n && mesh->color[n] == mesh->color[t]) continue;
            result = mesher__keep_facet(mesh, worker, 4 * t + (delaunay_handle)i);
            if (result != MESHER_OK) return result;
        }
    for (t = 1; t < mesh->num_tets; t++) mesher__keep_in(domain, t, seen);
    for (k = 0; k < domain->num_facets; k++) {
        const uint32_t *f = domain->facets + 3 * (size_t)k;
        if (!seen[(size_t)domain->num_edges + k])
            mesher_report_add(report, MESHER_DEFECT_NOT_IN_MESH, domain->facet_source[k],
                              DELAUNAY_NO_ID, f[0], f[1], f[2],
                              domain->surface.xyz + 3 * (size_t)f[0]);
    }
    for (k = 0; k < domain->num_edges; k++) {
        const uint32_t *e = domain->edges + 2 * (size_t)k;
        if (!seen[k] && domain->edge_source[k] >= domain->surface.num_triangles)
            mesher_report_add(report, MESHER_DEFECT_NOT_IN_MESH, domain->edge_source[k],
                              DELAUNAY_NO_ID, e[0], e[1], DELAUNAY_NO_ID,
                              domain->surface.xyz + 3 * (size_t)e[0]);
    }
    return mesher__count_defects(report) ? MESHER_ERROR_SURFACE : MESHER_OK;
}

/* Lists the regions of a mesh of the caller's: numbers, tetrahedra and volumes. */
static mesher_result mesher__list_regions(mesher_domain *domain, mesher_report *report)
{
    const delaunay_mesh *mesh = &domain->mesh;
    const size_t num_tets = mesh->num_tets - 1;
    size_t i, n = 0;
    mesher_region *r = NULL;
    mesher_result result = MESHER_ERROR_OUT_OF_MEMORY;
    hxtsort_pair *pairs =
        (hxtsort_pair *)delaunay_alloc(&domain->memory, num_tets, sizeof *pairs);
    if (!pairs) return result;
    for (i = 0; i < num_tets; i++) {
        pairs[i].key = mesh->color[i + 1];
        pairs[i].value = i + 1;
    }
    result = mesher__sort(domain, pairs, num_tets);
    if (result != MESHER_OK) goto done;
    for (i = 0; i < num_tets; i++) n += i == 0 || pairs[i].key != pairs[i - 1].key;
    result = MESHER_ERROR_OUT_OF_MEMORY;
    domain->regions =
        (mesher_region *)delaunay_alloc_zeroed(&domain->memory, n, sizeof *domain->regions);
    if (!domain->regions) goto done;
    for (i = 0; i < num_tets; i++) {
        const uint32_t *v = mesh->tets[pairs[i].value].v;
        double w[4];
        if (i == 0 || pairs[i].key != pairs[i - 1].key) {
            r = domain->regions + domain->num_regions++;
            r->number = (uint32_t)pairs[i].key;
            r->first_facet = DELAUNAY_NO_ID;
            r->depth = 1;
            r->kept = 1;
        }
        mesher__weights(mesh->vertices, v, mesh->vertices[v[0]].x, w);
        r->num_tets++;
        r->volume += w[0] / 6;
    }
    report->num_regions = n;
    result = MESHER_OK;
done:
    delaunay_release(&domain->memory, pairs);
    return result;
}

static mesher_result mesher__take_mesh(mesher_domain *domain, const uint32_t *tets,
                                       const uint32_t *regions, size_t num_tets,
                                       mesher_report *report)
{
    const mesher_surface *s = &domain->surface;
    delaunay_report import;
    delaunay_worker *worker = NULL;
    uint8_t *seen = NULL;
    delaunay_handle t;
    size_t i;
    mesher_result result;
    for (i = 0; i < num_tets && regions; i++)
        if (regions[i] == DELAUNAY_OUTSIDE) {
            snprintf(report->message, sizeof report->message,
                     "invalid argument: tetrahedron %lu has region number 0, the outside's",
                     (unsigned long)i);
            return MESHER_ERROR_INVALID_ARGUMENT;
        }
    memset(&import, 0, sizeof import);
    result = (mesher_result)delaunay_import(&domain->mesh, s->xyz, s->num_vertices, tets, regions,
                                            num_tets, &domain->options.host, &import);
    if (result != MESHER_OK) {
        snprintf(report->message, sizeof report->message, "%.400s", import.message);
        return result == MESHER_ERROR_OUT_OF_MEMORY || result == MESHER_ERROR_TOO_LARGE
                   ? result
                   : MESHER_ERROR_INVALID_ARGUMENT;
    }
    result = (mesher_result)delaunay_enable_marks(&domain->mesh);
    for (t = 1; result == MESHER_OK && !regions && t < domain->mesh.num_tets; t++)
        domain->mesh.color[t] = 1;
    if (result == MESHER_OK) result = (mesher_result)delaunay_link_vertices(&domain->mesh);
    if (result != MESHER_OK) return result;
    worker = delaunay_worker_new(&domain->mesh.memory);
    seen = (uint8_t *)delaunay_alloc_zeroed(
        &domain->memory, (size_t)domain->num_edges + domain->num_facets, sizeof *seen);
    result = worker && seen ? mesher__keep_surface(domain, worker, seen, report)
                            : MESHER_ERROR_OUT_OF_MEMORY;
    delaunay_release(&domain->memory, seen);
    delaunay_worker_free(worker);
    if (result == MESHER_OK) result = mesher__list_regions(domain, report);
    return result;
}

MESHER_API mesher_result mesher_refine_mesh(mesher_domain *domain, const mesher_surface *surface,
                                            const uint32_t *tets, const uint32_t *regions,
                                            size_t num_tets, const mesher_options *options,
                                            mesher_report *report)
{
    mesher_report local;
    mesher_result result;
    int usable;
    if (domain) memset(domain, 0, sizeof *domain);
    if (!domain || !surface) return mesher__refuse(report);
    memset(&local, 0, sizeof local);
    if (!report) report = &local;
    mesher__report_reset(report, surface);
    if (!tets || num_tets == 0) {
        mesher__say(report, "there are no tetrahedra to refine");
        return MESHER_ERROR_INVALID_ARGUMENT;
    }
    if (num_tets > (delaunay_handle)-1 / 4) {
        mesher__message_failure(report, MESHER_ERROR_TOO_LARGE);
        return MESHER_ERROR_TOO_LARGE;
    }
    result = mesher__domain_init(domain, surface, tets, num_tets, options, report, &usable);
    if (result == MESHER_ERROR_SURFACE && usable &&
        mesher__count_defects(report) ==
            report->counts[MESHER_DEFECT_NO_CELL] + report->counts[MESHER_DEFECT_FLAT]) {
        mesher__report_drop_defects(report); /* the tetrahedra say what is inside */
        result = MESHER_OK;
    }
    if (result == MESHER_OK) result = mesher__take_mesh(domain, tets, regions, num_tets, report);
    if (result == MESHER_ERROR_SURFACE) mesher__message_finish(report);
    if (result == MESHER_OK) {
        domain->keeps_mesh = 1;
        domain->stage = MESHER__STAGE_COLORED;
        if (!domain->options.no_refine) result = mesher__mesh_size(domain, report);
    }
    report->peak_bytes = domain->memory.peak_bytes + domain->mesh.memory.peak_bytes;
    return mesher__end(domain, report, result);
}

/* Writes the region of kept tetrahedron t to its side of those facets that it has. */
static void mesher__export_sides(const mesher_domain *domain, const mesher_output *out,
                                 delaunay_handle t)
{
    const delaunay_mesh *mesh = &domain->mesh;
    int i, j;
    for (i = 0; i < 4; i++) {
        const uint8_t *order = delaunay_facet_order(i);
        const uint32_t *corner;
        uint32_t v[3], sorted[3], f;
        if (!(mesh->flags[t] & DELAUNAY_FACET_BIT(i))) continue;
        for (j = 0; j < 3; j++) v[j] = mesh->vertices[mesh->tets[t].v[order[j]]].key;
        memcpy(sorted, v, sizeof sorted);
        (void)mesher__ascend(sorted);
        f = mesher__facet_find(domain, sorted);
        if (f == DELAUNAY_NO_ID) continue;
        corner = out->triangles + 3 * (size_t)f;
        for (j = 0; v[j] != corner[0]; j++) {}
        out->triangle_regions[2 * (size_t)f + (v[(j + 1) % 3] != corner[1])] = mesh->color[t];
    }
}

/* Writes the kept tetrahedra of a block; n: the output number of the first one. */
static void mesher__export_block(const mesher_domain *domain, const mesher_output *out, int b,
                                 uint64_t n)
{
    const delaunay_mesh *mesh = &domain->mesh;
    delaunay_handle t = mesher__output_block(mesh, b), end = mesher__output_block(mesh, b + 1);
    int i;
    for (; t < end; t++) {
        if (!mesher__is_inside(mesh, t)) continue;
        for (i = 0; i < 4; i++)
            out->tets[4 * n + (uint64_t)i] = mesh->vertices[mesh->tets[t].v[i]].key;
        out->regions[n++] = mesh->color[t];
        if (out->num_triangles && mesh->flags[t]) mesher__export_sides(domain, out, t);
    }
}

/* Writes triangles (with the outside on both sides, so far) and lines. */
static void mesher__export_surface(const mesher_domain *domain, const mesher_output *out)
{
    const mesher_surface *s = &domain->surface;
    size_t i;
    int k;
    for (i = 0; i < (size_t)out->num_triangles; i++) {
        size_t from = domain->facet_source[i];
        for (k = 0; k < 3; k++)
            out->triangles[3 * i + (size_t)k] =
                domain->survivor[s->triangles[3 * from + (size_t)k]];
        out->triangle_source[i] = (uint32_t)from;
        out->triangle_tags[i] = s->triangle_tags ? s->triangle_tags[from] : 1;
        out->triangle_regions[2 * i] = out->triangle_regions[2 * i + 1] = DELAUNAY_OUTSIDE;
    }
    for (i = 0; i < (size_t)out->num_edges; i++) {
        for (k = 0; k < 2; k++)
            out->edges[2 * i + (size_t)k] = domain->survivor[s->edges[2 * i + (size_t)k]];
        out->edge_tags[i] = s->edge_tags ? s->edge_tags[i] : 1;
    }
}

static int mesher__is_moved(const double *a, const double *b)
{
    return a[0] != b[0] || a[1] != b[1] || a[2] != b[2];
}

/* Writes the coordinates, by output number. Input vertices get the caller's bytes (-0 stays -0),
 * unless the mesh has moved them since. */
static void mesher__export_points(const mesher_domain *domain, double *xyz)
{
    const delaunay_mesh *mesh = &domain->mesh;
    uint32_t v, moved = 0;
    memcpy(xyz, domain->surface.xyz, 3 * (size_t)domain->first_corner * sizeof *xyz);
    for (v = 1; v < mesh->num_vertices; v++) {
        double *x;
        if (mesh->vertices[v].key == DELAUNAY_NO_ID) continue;
        x = xyz + 3 * (size_t)mesh->vertices[v].key;
        if (mesh->vertex_id[v] != DELAUNAY_NO_ID) {
            if (!mesher__is_moved(x, mesh->vertices[v].x)) continue;
            moved = 1;
        }
        memcpy(x, mesh->vertices[v].x, 3 * sizeof *x);
    }
    for (v = 0; moved && v < domain->first_corner; v++) { /* duplicates go with their survivors */
        const double *x = xyz + 3 * (size_t)domain->survivor[v];
        if (mesher__is_moved(xyz + 3 * (size_t)v, x)) memcpy(xyz + 3 * (size_t)v, x, 3 * sizeof *x);
    }
}

/* Allocates the arrays for the counts of the output. Returns 0 without memory. */
static int mesher__output_room(mesher_output *out)
{
    delaunay_memory *m = &out->memory;
    size_t vertices = (size_t)out->num_vertices, tets = (size_t)out->num_tets,
           triangles = (size_t)out->num_triangles, edges = (size_t)out->num_edges;
    out->xyz = (double *)delaunay_alloc(m, vertices, 3 * sizeof *out->xyz);
    out->tets = (uint32_t *)delaunay_alloc(m, tets, 4 * sizeof *out->tets);
    out->regions = (uint32_t *)delaunay_alloc(m, tets, sizeof *out->regions);
    out->triangles = (uint32_t *)delaunay_alloc(m, triangles, 3 * sizeof *out->triangles);
    out->triangle_source = (uint32_t *)delaunay_alloc(m, triangles, sizeof *out->triangle_source);
    out->triangle_tags = (int32_t *)delaunay_alloc(m, triangles, sizeof *out->triangle_tags);
    out->triangle_regions =
        (uint32_t *)delaunay_alloc(m, triangles, 2 * sizeof *out->triangle_regions);
    out->edges = (uint32_t *)delaunay_alloc(m, edges, 2 * sizeof *out->edges);
    out->edge_tags = (int32_t *)delaunay_alloc(m, edges, sizeof *out->edge_tags);
    return out->xyz && out->tets && out->regions && out->triangles && out->triangle_source &&
           out->triangle_tags && out->triangle_regions && out->edges && out->edge_tags;
}

MESHER_API mesher_result mesher_export(mesher_domain *domain, mesher_output *out)
{
    mesher_result result;
    uint64_t before[MESHER__OUTPUT_BLOCKS + 1];
    int b, threads;
    if (out) memset(out, 0, sizeof *out);
    if (!domain || !out || domain->stage < MESHER__STAGE_COLORED)
        return MESHER_ERROR_INVALID_ARGUMENT;
    result = (mesher_result)delaunay_canonicalize(&domain->mesh, &domain->options.host);
    if (result == MESHER_OK)
        result = (mesher_result)delaunay_memory_init(&out->memory, &domain->options.host);
    if (result != MESHER_OK) return result;
    out->num_vertices = mesher__number_output(domain, before);
    out->num_tets = before[MESHER__OUTPUT_BLOCKS];
    out->num_triangles = domain->surface_steiner ? 0 : domain->num_facets;
    out->num_edges = domain->surface_steiner ? 0 : domain->surface.num_edges;
    if (!mesher__output_room(out)) {
        mesher_output_free(domain, out);
        return MESHER_ERROR_OUT_OF_MEMORY;
    }
    mesher__export_points(domain, out->xyz);
    mesher__export_surface(domain, out);
    threads = delaunay_threads_for(&domain->options.host, domain->mesh.num_tets);
    (void)threads;
    /* Shared: the mesh, read only; each block has its part of the arrays, and each side of a
     * triangle is written for the one tetrahedron there. */
    MESHER__OMP(omp parallel for schedule(dynamic, 4) num_threads(threads))
    for (b = 0; b < MESHER__OUTPUT_BLOCKS; b++) mesher__export_block(domain, out, b, before[b]);
    return MESHER_OK;
}

MESHER_API void mesher_output_free(mesher_domain *domain, mesher_output *out)
{
    delaunay_memory *m;
    (void)domain;
    if (!out) return;
    m = &out->memory;
    if (m->allocator.release) {
        delaunay_release(m, out->xyz);
        delaunay_release(m, out->tets);
        delaunay_release(m, out->regions);
        delaunay_release(m, out->triangles);
        delaunay_release(m, out->triangle_source);
        delaunay_release(m, out->triangle_tags);
        delaunay_release(m, out->triangle_regions);
        delaunay_release(m, out->edges);
        delaunay_release(m, out->edge_tags);
    }
    memset(out, 0, sizeof *out);
}

#endif /* MESHER_IMPLEMENTATION */

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
