/* meshio.h - v0.1.0 - read and write surfaces, points and tetrahedral meshes; trusts no file
 *
 *   #define MESHIO_IMPLEMENTATION
 *   #include "meshio.h"
 *
 *   int main(void)
 *   {
 *       meshio_mesh mesh = {0};
 *       meshio_report report;
 *       if (meshio_read("part.stl", MESHIO_FORMAT_AUTO, &mesh, &report) != MESHIO_OK) {
 *           puts(report.message);                       // "line 12: expected a number, found ..."
 *           return 1;
 *       }
 *       meshio_write("part.mesh", &mesh, NULL, &report);
 *       meshio_free(&mesh);
 *       return 0;
 *   }
 *
 *   cc -O2 main.c -lm
 *
 * Contents (search for the tag)
 *   >>declarations  the public part: all that a user of this header needs to read
 *   >>arrays        growing arrays, the mesh under construction
 *   >>text          tokens, integers, correctly rounded doubles
 *   >>binary        bounded reads, byte order
 *   >>facets        triangulation of planar facets with holes and several loops
 *   >>inflate       zlib streams, base64
 *   >>stl >>off >>obj >>ply >>medit >>msh >>cells >>vtk >>vtu >>tetgen >>inp >>points >>sizes:
 *                   readers
 *   >>output        a buffered file that remembers its first error
 *   >>writers       one function for each format
 *   >>public        the functions declared at the top
 *
 * Reads
 *   STL (ASCII, binary; equal corners become one vertex), OFF, OBJ, PLY (ASCII, both byte orders),
 *   Medit .mesh and .meshb (versions 1-4, both byte orders), MSH 1 (ASCII), 2.x, 4.0 and 4.1
 *   (ASCII, binary), legacy VTK (ASCII, binary), VTU (ASCII, binary and appended, raw and base64,
 *   compressed by zlib or not), TetGen .node .ele (with .face) .poly .smesh, Abaqus and CalculiX
 *   .inp (nodes, elements, surfaces made of element facets; parts, if each has one instance only),
 *   and points: .xyz (text), .bin (raw little-endian doubles). Sizes at vertices: .sol of Medit and
 *   Mmg (text), .mtr of TetGen.
 * Writes
 *   Medit .mesh .meshb, MSH 2.2 and 4.1, VTU, legacy VTK, .inp, .node + .ele + .face, STL, OFF,
 *   OBJ. An .inp file has the regions as element sets, the triangles as surfaces and as node sets,
 *   and the edges as node sets; its coordinates have at most 20 characters: 13 digits or more. A
 *   surface between regions is made of facets on one side: in the region that is behind most of its
 *   triangles (they are counter-clockwise seen from outside of it). A triangle that is not beside
 *   that region, or has it on both sides, stands for the facet behind it.
 *   Sizes at vertices: .sol and .mtr.
 *
 * What it does not do
 *   Of elements of higher order only the corners are kept. Hexahedra, prisms and pyramids are
 *   counted, but not kept. Not supported: VTU of several pieces or compressed by LZ4 or LZMA,
 *   binary OFF, MSH 3, .inp that includes other files or generates nodes or elements by rules. At
 *   most 2^32 - 2 vertices. Numbers in text are read as correctly rounded doubles. The slow path
 *   of this is strtod(), and the writers use snprintf(), so the program must stay in the "C"
 *   numeric locale (in which every program starts).
 *
 * How it works
 *   A file is loaded as a whole, a zero byte is put after it, and a cursor walks over it. Every
 *   count that the file claims is compared with the number of bytes left before anything is
 *   allocated, so memory is at most a small multiple of the file's size. Indices are checked when
 *   they are read. The first error ends the reading, with a status, a sentence, a line (text) or
 *   an offset (binary), and an empty mesh. Numbers of OFF and PLY files may stand on lines in any
 *   way, but where most elements have a line each, one that has not is an error (in OFF, if the
 *   line ends too early). Polygons are cut into a fan from their first corner. Polygons that such
 *   a fan does not cover exactly, and facets of .poly files, which may have holes, are triangulated
 *   in their plane (sweep line, recovery of the segments by flips, exact orientation tests). A
 *   written file appears under its name only when it is complete.
 *
 * Compile-time switches (define them in the file that has MESHIO_IMPLEMENTATION)
 *   MESHIO_STATIC                                all functions are static
 *   MESHIO_MALLOC, MESHIO_REALLOC, MESHIO_FREE   define all three or none; default: the C library
 *
 * Licence: MIT or public domain, text at the end.
 * SPDX-License-Identifier: MIT OR Unlicense
 */

/* ---- >>declarations ---------------------------------------------------------------------- */
#ifndef MESHIO_H
#define MESHIO_H

#define MESHIO_VERSION 100

#include <stddef.h>
#include <stdint.h>

#ifndef MESHIO_API
#  if !defined(MESHIO_STATIC)
#    define MESHIO_API extern
#  elif defined(__GNUC__)
#    define MESHIO_API static __attribute__((unused))
#  else
#    define MESHIO_API static
#  endif
#endif

#ifdef __cplusplus
extern "C" {
#endif

typedef enum meshio_result {
    MESHIO_OK = 0,
    MESHIO_ERROR_INVALID_ARGUMENT = -1,
    MESHIO_ERROR_OUT_OF_MEMORY = -2,
    MESHIO_ERROR_TOO_LARGE = -4,   /* e.g. more than 2^32 - 2 vertices or elements of a kind */
    MESHIO_ERROR_OPEN = -96,       /* cannot open the file                             */
    MESHIO_ERROR_READ = -97,       /* the file system failed while reading             */
    MESHIO_ERROR_FORMAT = -98,     /* unknown extension, or not a file of this format  */
    MESHIO_ERROR_UNSUPPORTED = -99,/* a variant of the format that is not read here    */
    MESHIO_ERROR_SYNTAX = -100,    /* the file has something else than is expected     */
    MESHIO_ERROR_TRUNCATED = -101, /* the file ends early                              */
    MESHIO_ERROR_COUNT = -102,     /* a count is impossible, or contradicts the data   */
    MESHIO_ERROR_INDEX = -103,     /* the file refers to a vertex that does not exist  */
    MESHIO_ERROR_WRITE = -104      /* cannot create, write or rename the output        */
} meshio_result;

typedef enum meshio_format {
    MESHIO_FORMAT_AUTO = 0, /* by extension */
    MESHIO_FORMAT_STL,
    MESHIO_FORMAT_OFF,
    MESHIO_FORMAT_OBJ,
    MESHIO_FORMAT_PLY,
    MESHIO_FORMAT_MEDIT,
    MESHIO_FORMAT_MEDIT_BINARY,
    MESHIO_FORMAT_MSH,  /* read: any version; write: 2.2 */
    MESHIO_FORMAT_MSH4, /* .msh4; write: 4.1             */
    MESHIO_FORMAT_VTK,
    MESHIO_FORMAT_VTU,
    MESHIO_FORMAT_INP,
    MESHIO_FORMAT_NODE,
    MESHIO_FORMAT_ELE, /* read: with the .node file beside it, and the .face file if there is one;
                        * write: .node, .face and .ele */
    MESHIO_FORMAT_POLY,
    MESHIO_FORMAT_SMESH,
    MESHIO_FORMAT_XYZ,
    MESHIO_FORMAT_BIN
} meshio_format;

/* The name of a physical group of Gmsh: all elements of a dimension (0: points, 1: lines, 2:
 * triangles, 3: tetrahedra) with this tag. */
typedef struct meshio_name {
    int dimension;
    int32_t tag;
    char text[128]; /* the first 127 bytes, without quotes */
} meshio_name;

/* Everything that a file can hold and a mesher needs, in plain arrays that the struct owns; an
 * array is NULL where its number is 0. Zero the struct before use. Indices are 0-based. Tags are
 * the numbers that the file itself gives:
 *
 *   Medit      references
 *   MSH        physical tags, or elementary tags of what is in no physical group
 *   TetGen     markers of vertices and facets, the first attribute of tetrahedra
 *   STL, OBJ   the number of the solid or group, from 1, if the file has several; else 0
 *   VTK, VTU   the cell array `region` (or tag, material, CellEntityIds, cell_scalars, medit:ref,
 *              gmsh:physical); else 0
 *   .inp       the number at the end of the surface's name, or of the name of the set (ELSET) that
 *              the *ELEMENT card gives; without a set, for tetrahedra, the number at the end of
 *              the name of their section's set; else the number of the part, from 1, if several
 *              parts have nodes; else 0. A name that does not end in a number stands for the number
 *              of the first card with this name, where only cards with such names count, from 1. */
typedef struct meshio_mesh {
    double *xyz;            /* 3*num_vertices */
    int32_t *vertex_tags;   /* num_vertices */
    uint32_t *edges;        /* 2*num_edges */
    int32_t *edge_tags;     /* num_edges */
    uint32_t *triangles;    /* 3*num_triangles */
    int32_t *triangle_tags; /* num_triangles */
    uint32_t *tets;         /* 4*num_tets */
    int32_t *tet_tags;      /* num_tets */
    double *holes;          /* 3*num_holes: a point in every cavity to leave empty (TetGen) */
    double *regions;        /* 5*num_regions: x y z, attribute, largest volume or -1 (TetGen) */
    size_t num_vertices, num_edges, num_triangles, num_tets, num_holes, num_regions;
    size_t num_other;       /* elements that are counted, but not kept, including num_solids */
    size_t num_solids;      /* hexahedra, prisms, pyramids and the like */
    size_t num_thin;        /* faces of fewer than three corners; num_other counts them, too */
    size_t num_regrouped;   /* MSH: memberships in physical groups that are lost, as an element in
                             * several groups gets the tag of the first one only */
    /* num_vertices entries, or NULL if num_spare is 0. Nonzero marks a vertex that is a corner of
     * nothing that is kept, but either a node in the middle of an edge, face or tetrahedron of
     * higher order, or a point that Gmsh saved and that is in no physical group, such as the centre
     * of a circle. */
    uint8_t *spare;
    size_t num_spare;
    meshio_name *names;     /* num_names: from and for .msh of versions 2 and 4 */
    size_t num_names;
    /* For the writers of .msh (2.2), .vtu and .inp; readers leave it 0. Nonzero: edges, triangles
     * and tets have 3, 6 and 10 vertices an element. The corners come first, then the midpoints of
     * the edges, of triangles in the order 01 12 20, of tets 01 12 02 03 13 23, whatever the order
     * in the format. */
    int second_order;
    size_t num_corners;     /* STL: corners in the file, before equal ones became one vertex */
    char name[64];          /* the name that the file gives to itself, or "" */
} meshio_mesh;

/* What went wrong, and where. Every call fills it. The message is a sentence, "" after success. */
typedef struct meshio_report {
    meshio_result result;
    uint64_t line;   /* from 1; 0 if the place is not in a text file */
    uint64_t offset; /* in bytes, from 0 */
    char message[320];
} meshio_report;

/* One number for each cell, for viewers; only VTU and VTK files hold it. The name has 1 to 100
 * characters, none of them blank, a control character or one of " & < >. NULL arrays count as 0. */
typedef struct meshio_field {
    const char *name;
    const double *edges, *triangles, *tets;
} meshio_field;

typedef struct meshio_write_options {
    meshio_format format;       /* MESHIO_FORMAT_AUTO: by extension */
    int ascii;                  /* VTU and STL are binary unless this is set */
    int binary;                 /* VTK and MSH are text unless this is set */
    const meshio_field *fields; /* may be NULL */
    size_t num_fields;
    int num_threads;            /* with OpenMP, for .mesh, .msh (2.2) and .inp; 0 means 1. The
                                 * bytes written do not depend on it */
} meshio_write_options;

/* Read a file.
 *
 *   path    in   its extension decides on the format, unless `format` does
 *   format  in   MESHIO_FORMAT_AUTO: by extension
 *   mesh    out  overwritten without being freed; zeroed on failure
 *   report  out  may be NULL
 *
 * Returns  MESHIO_OK, also for a file that properly states that it has no vertices
 * Cost     linear, but for sorting, and for facets of .poly files: quadratic in the size of a facet
 *          in the worst case. Memory is about 6 times the file's size for common files, whatever
 *          the file claims, and at most some 30 times (for polygons of a byte or two a corner).
 *          Where a file is compressed, the size of what it holds counts, which is at most 1040
 *          times its own.
 * Threads  distinct calls may run at once */
MESHIO_API meshio_result meshio_read(const char *path, meshio_format format, meshio_mesh *mesh,
                                     meshio_report *report);

/* The same from `size` bytes in memory; the format must be given. No other file is read, so an .ele
 * file, or a .poly file without nodes of its own, fails for want of its .node file. */
MESHIO_API meshio_result meshio_read_memory(const void *bytes, size_t size, meshio_format format,
                                            meshio_mesh *mesh, meshio_report *report);

/* Read one number for each vertex of a mesh, such as a size, from a file of its own.
 *
 *   path    in   .sol (text: MeshVersionFormatted, Dimension 3, SolAtVertices, in this order; one
 *                scalar a vertex) or .mtr
 *   values  out  count numbers; undefined on failure
 *   count   in   how many the file must have: one for each vertex of the mesh
 *   report  out  may be NULL
 *
 * Returns  MESHIO_OK; _ERROR_COUNT: the file has another number of values; _ERROR_UNSUPPORTED:
 *          vectors or tensors, or several numbers a vertex; and as meshio_read */
MESHIO_API meshio_result meshio_read_sizes(const char *path, double *values, size_t count,
                                           meshio_report *report);
/* Write such a file, .sol (in double precision) or .mtr: first under a temporary name, as
 * meshio_write does. Every bit of the values is kept. */
MESHIO_API meshio_result meshio_write_sizes(const char *path, const double *values, size_t count,
                                            meshio_report *report);

/* Write a file: first under a temporary name beside it (path + ".part"), which is renamed when the
 * file is complete. On failure nothing is left, and an older file of that name is untouched.
 * Devices and pipes are written directly. The three TetGen files appear one after the other.
 * Surface formats get the triangles only. More vertices or elements than the 32-bit integers of a
 * binary format (Medit, MSH 2.2, VTK, STL) can count are MESHIO_ERROR_TOO_LARGE, before anything is
 * written. `options` and `report` may be NULL. */
MESHIO_API meshio_result meshio_write(const char *path, const meshio_mesh *mesh,
                                      const meshio_write_options *options, meshio_report *report);

/* Free the arrays and zero the struct; may be called twice. */
MESHIO_API void meshio_free(meshio_mesh *mesh);

/* The format that the path's extension stands for, in upper or lower case; MESHIO_FORMAT_AUTO if it
 * stands for none. */
MESHIO_API meshio_format meshio_format_of(const char *path);
/* True if tetrahedra can be written in this format. */
MESHIO_API int meshio_holds_tetrahedra(meshio_format format);
/* The same for triangles. */
MESHIO_API int meshio_holds_triangles(meshio_format format);

/* A short description of a status. */
MESHIO_API const char *meshio_result_string(meshio_result result);

/* The double nearest to the decimal number that text[0..length) begins with: sign, digits, '.',
 * exponent (e, or Fortran's d); or inf, or nan, in the words of C or of Windows (1.#INF). Returns
 * the number of characters used, 0 if there is no number. text[length] must be readable and not
 * part of a number (the zero at the end of a string, for example). */
MESHIO_API size_t meshio_parse_double(const char *text, size_t length, double *value);

#ifdef __cplusplus
}
#endif
#endif /* MESHIO_H */

/* ---- >>implementation: readers of the interface may stop here ------------------------------ */
#if defined(MESHIO_IMPLEMENTATION) && !defined(MESHIO_IMPLEMENTATION_DONE)
#define MESHIO_IMPLEMENTATION_DONE

#include <errno.h>
#include <float.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#ifdef _OPENMP
#  include <omp.h>
#endif
#if (defined(__unix__) || defined(__APPLE__)) && \
    (!defined(__STRICT_ANSI__) || defined(_XOPEN_SOURCE))
#  include <sys/stat.h>
#  define MESHIO__STAT 1
#endif

#ifdef __FAST_MATH__
#  error "meshio.h: exact rounding and exact signs need IEEE arithmetic, not -ffast-math"
#endif

#ifndef MESHIO_MALLOC
#  define MESHIO_MALLOC(size) malloc(size)
#  define MESHIO_REALLOC(pointer, size) realloc(pointer, size)
#  define MESHIO_FREE(pointer) free(pointer)
#endif

#if defined(__GNUC__)
#  define MESHIO__PRINTF(a, b) __attribute__((format(printf, a, b)))
#else
#  define MESHIO__PRINTF(a, b)
#endif

/* Returns the status of a failed step from the calling function, which must own nothing. */
#define MESHIO__TRY(step)                                                                          \
    do {                                                                                           \
        meshio_result meshio__status = (step);                                                     \
        if (meshio__status != MESHIO_OK) return meshio__status;                                    \
    } while (0)

#define MESHIO__MAX_COUNT ((size_t)0xFFFFFFFEu)

/* The types of scalars in PLY, VTK and VTU files. */
typedef enum meshio__type {
    MESHIO__I8,
    MESHIO__U8,
    MESHIO__I16,
    MESHIO__U16,
    MESHIO__I32,
    MESHIO__U32,
    MESHIO__I64,
    MESHIO__U64,
    MESHIO__F32,
    MESHIO__F64,
    MESHIO__NO_TYPE
} meshio__type;

/* A growing array of uint32_t, and one of uint64_t. */
typedef struct meshio__u32s {
    uint32_t *data;
    size_t num, cap;
    int failed; /* memory ran out: an item could not be added */
} meshio__u32s;

typedef struct meshio__u64s {
    uint64_t *data;
    size_t num, cap;
} meshio__u64s;

/* Cells of VTK and VTU files, kept until their types and tags are known. */
typedef struct meshio__cells {
    meshio__u32s corners; /* of all cells, one after the other */
    meshio__u64s ends;    /* for each cell the index in `corners` after its last one */
    meshio__u32s types;   /* VTK's numbers */
    meshio__u32s tags;    /* bits of an int32_t; empty if the file has no tags */
} meshio__cells;

/* The state of one reader: the cursor, the mesh under construction, and all scratch memory. */
typedef struct meshio__reader {
    const unsigned char *begin, *p, *end; /* *end is a readable zero */
    meshio_mesh *mesh;
    size_t cap_xyz, cap_vertex_tags, cap_edges, cap_edge_tags, cap_triangles, cap_triangle_tags,
        cap_tets, cap_tet_tags, cap_holes, cap_regions, cap_names;
    meshio_report *report;
    const unsigned char *aside; /* if p and end are in decoded bytes: the tag of the array in the
                                 * file that they come from, for messages; else NULL */
    int text;    /* errors are located by line */
    int comment; /* the character that starts a comment, 0: none */
    int swap;    /* the file's byte order is not this machine's */
    /* polygon: the corners of one; table: the hash table of STL vertices; scratch: of facets */
    meshio__u32s polygon, table, scratch;
    /* ids: pairs (id in the file, vertex), unless the ids are consecutive; entities: of MSH, pairs
     * (entity, physical tag), of .inp, pairs (hash of a name, number) */
    meshio__u64s ids, entities;
    meshio__u64s grouped;  /* MSH: pairs (entity in several physical groups, number of groups) */
    meshio__u64s polygons; /* of more than 3 corners: pairs (first triangle of the fan, corners) */
    meshio__u32s spare;    /* vertices that may turn out to be spare; with repetitions */
    int ids_consecutive;
    int id_bits; /* the file's own number is in this many low bits of an id; 0: it is the id */
    uint64_t first_id;
    meshio__cells cells;
    unsigned char *decoded, *packed; /* VTU: an array after zlib, and after base64 */
    size_t cap_decoded, cap_packed;
} meshio__reader;

/* ---- >>arrays  growing arrays, the mesh under construction -------------------------------- */

/* The end of the line: the line feed, or carriage return, from p on; `end` if there is none. */
static const unsigned char *meshio__line_end(const unsigned char *p, const unsigned char *end)
{
    while (p < end && *p != '\n' && *p != '\r') p++;
    return p;
}

static void meshio__locate(const meshio__reader *r, const unsigned char *where)
{
    const unsigned char *p = r->begin;
    if (r->aside) where = r->aside;
    r->report->offset = (uint64_t)(where - r->begin);
    r->report->line = 0;
    if (!r->text) return;
    r->report->line = 1;
    for (; (p = meshio__line_end(p, where)) < where; p++)
        if (*p == '\n' || p[1] != '\n') r->report->line++;
}

/* Writes the status, a message and the place into the report; returns the status. */
static meshio_result meshio__fail(meshio__reader *r, meshio_result result,
                                  const unsigned char *where, const char *format, ...)
    MESHIO__PRINTF(4, 5);
static meshio_result meshio__fail(meshio__reader *r, meshio_result result,
                                  const unsigned char *where, const char *format, ...)
{
    meshio_report *report = r->report;
    char text[200];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    report->result = result;
    meshio__locate(r, where);
    if (r->text)
        snprintf(report->message, sizeof report->message, "line %llu: %s",
                 (unsigned long long)report->line, text);
    else
        snprintf(report->message, sizeof report->message, "byte %llu: %s",
                 (unsigned long long)report->offset, text);
    return result;
}

static meshio_result meshio__no_memory(meshio__reader *r)
{
    return meshio__fail(r, MESHIO_ERROR_OUT_OF_MEMORY, r->p, "out of memory");
}

/* Makes room for `need` items, growing by half. On failure the array stays as it was. */
static int meshio__reserve(void **data, size_t *cap, size_t need, size_t item)
{
    size_t wanted = *cap + *cap / 2 + 16;
    void *grown;
    if (need <= *cap) return 1;
    if (wanted < need) wanted = need;
    if (wanted > (size_t)-1 / item) return 0;
    grown = MESHIO_REALLOC(*data, wanted * item);
    if (!grown) return 0;
    *data = grown;
    *cap = wanted;
    return 1;
}

static int meshio__push32(meshio__u32s *a, uint32_t value)
{
    void *data = a->data;
    if (a->num == a->cap) {
        if (!meshio__reserve(&data, &a->cap, a->num + 1, sizeof *a->data)) {
            a->failed = 1;
            return 0;
        }
        a->data = (uint32_t *)data;
    }
    a->data[a->num++] = value;
    return 1;
}

static int meshio__push64(meshio__u64s *a, uint64_t value)
{
    void *data = a->data;
    if (a->num == a->cap) {
        if (!meshio__reserve(&data, &a->cap, a->num + 1, sizeof *a->data)) return 0;
        a->data = (uint64_t *)data;
    }
    a->data[a->num++] = value;
    return 1;
}

static int meshio__reserve_doubles(double **array, size_t *cap, size_t need)
{
    void *data = *array;
    if (need <= *cap) return 1;
    if (!meshio__reserve(&data, cap, need, sizeof(double))) return 0;
    *array = (double *)data;
    return 1;
}

static int meshio__reserve_ids(uint32_t **array, size_t *cap, size_t need)
{
    void *data = *array;
    if (need <= *cap) return 1;
    if (!meshio__reserve(&data, cap, need, sizeof(uint32_t))) return 0;
    *array = (uint32_t *)data;
    return 1;
}

static int meshio__reserve_tags(int32_t **array, size_t *cap, size_t need)
{
    void *data = *array;
    if (need <= *cap) return 1;
    if (!meshio__reserve(&data, cap, need, sizeof(int32_t))) return 0;
    *array = (int32_t *)data;
    return 1;
}

/* Refuses a reference that would change if it were kept in 32 bits. */
static meshio_result meshio__tag_fits(meshio__reader *r, int64_t tag)
{
    if (tag == (int32_t)tag) return MESHIO_OK;
    return meshio__fail(r, MESHIO_ERROR_TOO_LARGE, r->p, "a reference beyond 32 bits");
}

static meshio_result meshio__add_vertex(meshio__reader *r, const double xyz[3], int64_t tag)
{
    meshio_mesh *m = r->mesh;
    size_t n = m->num_vertices;
    if (n >= MESHIO__MAX_COUNT)
        return meshio__fail(r, MESHIO_ERROR_TOO_LARGE, r->p, "more than 2^32 - 2 vertices");
    MESHIO__TRY(meshio__tag_fits(r, tag));
    if (!meshio__reserve_doubles(&m->xyz, &r->cap_xyz, 3 * n + 3)) return meshio__no_memory(r);
    if (!meshio__reserve_tags(&m->vertex_tags, &r->cap_vertex_tags, n + 1))
        return meshio__no_memory(r);
    m->xyz[3 * n] = xyz[0];
    m->xyz[3 * n + 1] = xyz[1];
    m->xyz[3 * n + 2] = xyz[2];
    m->vertex_tags[n] = (int32_t)tag;
    m->num_vertices = n + 1;
    return MESHIO_OK;
}

/* Adds one element of k corners to the arrays of its kind, which are passed in. */
static meshio_result meshio__add_element(meshio__reader *r, int k, const uint32_t *v, int64_t tag,
                                         uint32_t **array, size_t *cap, int32_t **tags,
                                         size_t *cap_tags, size_t *num)
{
    size_t n = *num;
    int i;
    if (n >= MESHIO__MAX_COUNT)
        return meshio__fail(r, MESHIO_ERROR_TOO_LARGE, r->p, "more than 2^32 - 2 elements");
    MESHIO__TRY(meshio__tag_fits(r, tag));
    if (!meshio__reserve_ids(array, cap, (n + 1) * (size_t)k)) return meshio__no_memory(r);
    if (!meshio__reserve_tags(tags, cap_tags, n + 1)) return meshio__no_memory(r);
    for (i = 0; i < k; i++) (*array)[n * (size_t)k + (size_t)i] = v[i];
    (*tags)[n] = (int32_t)tag;
    *num = n + 1;
    return MESHIO_OK;
}

static meshio_result meshio__add_edge(meshio__reader *r, const uint32_t v[2], int64_t tag)
{
    meshio_mesh *m = r->mesh;
    return meshio__add_element(r, 2, v, tag, &m->edges, &r->cap_edges, &m->edge_tags,
                               &r->cap_edge_tags, &m->num_edges);
}

static meshio_result meshio__add_triangle(meshio__reader *r, uint32_t a, uint32_t b, uint32_t c,
                                          int64_t tag)
{
    meshio_mesh *m = r->mesh;
    uint32_t v[3];
    v[0] = a;
    v[1] = b;
    v[2] = c;
    return meshio__add_element(r, 3, v, tag, &m->triangles, &r->cap_triangles, &m->triangle_tags,
                               &r->cap_triangle_tags, &m->num_triangles);
}

static meshio_result meshio__add_tet(meshio__reader *r, const uint32_t v[4], int64_t tag)
{
    meshio_mesh *m = r->mesh;
    return meshio__add_element(r, 4, v, tag, &m->tets, &r->cap_tets, &m->tet_tags, &r->cap_tet_tags,
                               &m->num_tets);
}

/* Notes vertices that an element lists, but not as its corners. */
static meshio_result meshio__add_spare(meshio__reader *r, const uint32_t *v, size_t n)
{
    size_t i;
    for (i = 0; i < n; i++)
        if (!meshio__push32(&r->spare, v[i])) return meshio__no_memory(r);
    return MESHIO_OK;
}

static void meshio__unmark(uint8_t *mark, const uint32_t *v, size_t n)
{
    size_t i;
    for (i = 0; i < n; i++) mark[v[i]] = 0;
}

/* After everything has been read: sets mesh->spare for those of the noted vertices that are corners
 * of nothing. */
static meshio_result meshio__find_spare(meshio__reader *r)
{
    meshio_mesh *m = r->mesh;
    size_t i;
    if (r->spare.num == 0) return MESHIO_OK;
    m->spare = (uint8_t *)MESHIO_MALLOC(m->num_vertices);
    if (!m->spare) return meshio__no_memory(r);
    memset(m->spare, 0, m->num_vertices);
    for (i = 0; i < r->spare.num; i++) m->spare[r->spare.data[i]] = 1;
    meshio__unmark(m->spare, m->edges, 2 * m->num_edges);
    meshio__unmark(m->spare, m->triangles, 3 * m->num_triangles);
    meshio__unmark(m->spare, m->tets, 4 * m->num_tets);
    for (i = 0; i < m->num_vertices; i++) m->num_spare += m->spare[i];
    if (m->num_spare > 0) return MESHIO_OK;
    MESHIO_FREE(m->spare);
    m->spare = NULL;
    return MESHIO_OK;
}

static meshio_result meshio__add_solid(meshio__reader *r)
{
    r->mesh->num_other++;
    r->mesh->num_solids++;
    return MESHIO_OK;
}

static meshio_result meshio__add_thin(meshio__reader *r)
{
    r->mesh->num_other++;
    r->mesh->num_thin++;
    return MESHIO_OK;
}

/* Adds a polygon as a fan from its first corner, which meshio__cut_polygons may replace later: the
 * coordinates may not have been read yet. */
static meshio_result meshio__add_polygon(meshio__reader *r, const uint32_t *v, size_t n,
                                         int64_t tag)
{
    size_t i;
    if (n < 3) return meshio__add_thin(r);
    if (n > 3 && (!meshio__push64(&r->polygons, r->mesh->num_triangles) ||
                  !meshio__push64(&r->polygons, n)))
        return meshio__no_memory(r);
    for (i = 2; i < n; i++) MESHIO__TRY(meshio__add_triangle(r, v[0], v[i - 1], v[i], tag));
    return MESHIO_OK;
}

/* A strip of triangles: the order of the corners alternates, so that all have one orientation. */
static meshio_result meshio__add_strip(meshio__reader *r, const uint32_t *v, size_t n, int64_t tag)
{
    size_t i;
    if (n == 1 || n == 2) return meshio__add_thin(r);
    for (i = 2; i < n; i++)
        MESHIO__TRY(meshio__add_triangle(r, v[i - 2], v[i - 1 + (i & 1)], v[i - (i & 1)], tag));
    return MESHIO_OK;
}

/* Checks that an index from the file is in first .. first + n - 1 and turns it into a vertex
 * number. */
static meshio_result meshio__vertex_of(meshio__reader *r, const unsigned char *where,
                                       int64_t index, int64_t first, size_t n, uint32_t *v)
{
    if (index < first || (uint64_t)(index - first) >= n) {
        if (n == 0)
            return meshio__fail(r, MESHIO_ERROR_INDEX, where,
                                "vertex %lld is used, but there are no vertices", (long long)index);
        return meshio__fail(r, MESHIO_ERROR_INDEX, where, "vertex %lld is outside %lld .. %lld",
                            (long long)index, (long long)first,
                            (long long)(first + (int64_t)n - 1));
    }
    *v = (uint32_t)(index - first);
    return MESHIO_OK;
}

/* The same for the vertices that have been read so far. */
static meshio_result meshio__vertex(meshio__reader *r, const unsigned char *where, int64_t index,
                                    int64_t first, uint32_t *v)
{
    return meshio__vertex_of(r, where, index, first, r->mesh->num_vertices, v);
}

/* Accepts a claimed count only if the rest of the file has room for that many items of at least
 * bytes_each bytes. */
static meshio_result meshio__fits(meshio__reader *r, int64_t count, size_t bytes_each,
                                  const char *what)
{
    size_t left = (size_t)(r->end - r->p);
    if (bytes_each == 0) bytes_each = 1;
    if (count < 0)
        return meshio__fail(r, MESHIO_ERROR_COUNT, r->p, "negative number of %s: %lld", what,
                            (long long)count);
    /* One byte more than is left: no separator needs to follow the last number of a text. */
    if ((uint64_t)count > ((uint64_t)left + 1) / bytes_each)
        return meshio__fail(r, MESHIO_ERROR_COUNT, r->p,
                            "the file claims %lld %s, but only %llu bytes are left",
                            (long long)count, what, (unsigned long long)left);
    if ((uint64_t)count > MESHIO__MAX_COUNT)
        return meshio__fail(r, MESHIO_ERROR_TOO_LARGE, r->p, "more than 2^32 - 2 %s", what);
    return MESHIO_OK;
}

/* ---- >>text  tokens, integers, correctly rounded doubles ----------------------------------- */

static int meshio__is_space(int c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

static int meshio__is_digit(int c) { return c >= '0' && c <= '9'; }

static int meshio__lower(int c) { return c >= 'A' && c <= 'Z' ? c + 32 : c; }

/* Can this character follow a number? End of the file, blank, comma, comment or XML tag. */
static int meshio__is_end(int c)
{
    return c == 0 || meshio__is_space(c) || c == ',' || c == '#' || c == '<';
}

/* Does text[0..length) equal a word, given in lower case, if its case is ignored? */
static int meshio__same(const unsigned char *text, size_t length, const char *word)
{
    size_t i;
    for (i = 0; i < length; i++)
        if (word[i] == 0 || meshio__lower(text[i]) != word[i]) return 0;
    return word[length] == 0;
}

/* *value becomes m * 10^e, rounded to nearest; returns 0 if that cannot be proven. m has up to 19
 * digits; |e| <= 22, so the power of ten is an exact double. Where m is one, too (m <= 2^53), one
 * multiplication or division rounds correctly. A larger m is split into hi + lo, both exact; the
 * quotient gets one correction step, after which its relative error is below 2^-100. If both ends
 * of that interval round to the same double, the result is right. */
static int meshio__fast_double(uint64_t m, int e, double *value)
{
    static const double power[23] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                     1e8,  1e9,  1e10, 1e11, 1e12, 1e13, 1e14, 1e15,
                                     1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
#if defined(FLT_EVAL_METHOD) && FLT_EVAL_METHOD != 0 && FLT_EVAL_METHOD != 1 &&                    \
    FLT_EVAL_METHOD != 16
    (void)m, (void)e, (void)value, (void)power;
    return 0;
#else
    const double splitter = 134217729.0; /* 2^27 + 1 */
    volatile double c; /* volatile: a product is rounded before it is subtracted (no FMA) */
    double hi, lo, p, q, qh, ql, ph, pl, rest, correction, a, b, slack;
    if (m <= (uint64_t)1 << 53) {
        *value = e < 0 ? (double)m / power[-e] : (double)m * power[e];
        return 1;
    }
    if (e > 0) return 0;
    hi = (double)(m & ~(uint64_t)2047);
    lo = (double)(m & 2047);
    p = power[-e];
    q = hi / p;
    c = splitter * q;
    qh = c - (c - q);
    ql = q - qh;
    c = splitter * p;
    ph = c - (c - p);
    pl = p - ph;
    c = q * p;
    rest = ((qh * ph - c) + qh * pl + ql * ph) + ql * pl; /* q * p == c + rest, exactly */
    correction = ((hi - c) - rest + lo) / p;
    slack = q * 7.8886090522101181e-31; /* 2^-100 */
    a = q + (correction - slack);
    b = q + (correction + slack);
    *value = a;
    return a == b;
#endif
}

/* The digits and the decimal point that p begins with, times 10^x, rounded to nearest, by strtod().
 * A decimal halfway between two doubles has at most 768 digits: of the digits after that many, it
 * matters only whether all are zeros. */
static double meshio__slow_double(const unsigned char *p, const unsigned char *end, int64_t x)
{
    char copy[832];
    size_t n = 0;
    int after_point = 0, more = 0;
    for (; p < end && (meshio__is_digit(*p) || *p == '.'); p++) {
        if (*p == '.') {
            after_point = 1;
            continue;
        }
        x -= after_point;
        if (n < 780) {
            if (n || *p != '0') copy[n++] = (char)*p;
        } else {
            x++;
            more |= *p != '0';
        }
    }
    if (more || n == 0) {
        copy[n++] = more ? '1' : '0';
        x--;
    }
    snprintf(copy + n, sizeof copy - n, "e%lld", (long long)x);
    return strtod(copy, NULL);
}

/* Reads an infinity or NaN, after its sign; also nan(ind), and what old libraries of Windows write:
 * 1.#INF00, 1.#QNAN or, rounded, 1.#J. Returns its length, 0: it is something else. */
static size_t meshio__parse_special(const unsigned char *p, const unsigned char *end, int negative,
                                    double *value)
{
    const unsigned char *q = p + 3;
    if (end - p < 3) return 0;
    if (meshio__same(p, 3, "nan")) {
        *value = strtod("nan", NULL);
        if (q == end || *q != '(') return 3;
        while (++q < end && (meshio__is_digit(*q) || *q == '_' ||
                             (meshio__lower(*q) >= 'a' && meshio__lower(*q) <= 'z'))) {}
        return q < end && *q == ')' ? (size_t)(q - p) + 1 : 3;
    }
    if (memcmp(p, "1.#", 3) == 0) {
        while (q < end && *q >= 'A' && *q <= 'Z') q++;
        if (q == p + 3 || q > p + 7) return 0;
        *value = !meshio__same(p + 3, (size_t)(q - p) - 3, "inf") ? strtod("nan", NULL)
                 : negative                                       ? -HUGE_VAL
                                                                  : HUGE_VAL;
        while (q < end && *q == '0') q++;
        return meshio__is_end(*q) ? (size_t)(q - p) : 0;
    }
    if (!meshio__same(p, 3, "inf")) return 0;
    *value = negative ? -HUGE_VAL : HUGE_VAL;
    return end - p >= 8 && meshio__same(p, 8, "infinity") ? 8 : 3;
}

MESHIO_API size_t meshio_parse_double(const char *text, size_t length, double *value)
{
    const unsigned char *s = (const unsigned char *)text, *end = s + length, *p = s;
    const unsigned char *first;
    size_t special;
    uint64_t m = 0;
    int64_t digits = 0, e = 0, x = 0;
    int kept = 0, negative = 0, sign = 1, fortran = 0;
    double d;
    char *stop;
    if (p < end && (*p == '-' || *p == '+')) negative = *p++ == '-';
    special = meshio__parse_special(p, end, negative, value);
    if (special) return (size_t)(p - s) + special;
    for (first = p; p < end && meshio__is_digit(*p); p++, digits++) {
        if (kept < 19) {
            m = 10 * m + (uint64_t)(*p - '0');
            kept += m != 0;
        } else {
            kept = 20, e++;
        }
    }
    if (p < end && *p == '.')
        for (p++; p < end && meshio__is_digit(*p); p++, digits++) {
            if (kept < 19) {
                m = 10 * m + (uint64_t)(*p - '0');
                kept += m != 0;
                e--;
            } else {
                kept = 20;
            }
        }
    if (digits == 0) return 0;
    if (p < end && (*p == 'e' || *p == 'E' || *p == 'd' || *p == 'D')) {
        const unsigned char *q = p + 1;
        if (q < end && (*q == '-' || *q == '+')) sign = *q++ == '-' ? -1 : 1;
        if (q < end && meshio__is_digit(*q)) {
            for (; q < end && meshio__is_digit(*q); q++)
                if (x < INT64_C(1000000000000000)) x = 10 * x + (*q - '0');
            fortran = *p == 'd' || *p == 'D';
            p = q;
            x *= sign;
            e += x;
        }
    }
    if (kept <= 19 && e >= -22 && e <= 22 && meshio__fast_double(m, (int)e, &d)) {
        *value = negative ? -d : d;
        return (size_t)(p - s);
    }
    if (fortran) {
        d = meshio__slow_double(first, p, x);
        *value = negative ? -d : d;
        return (size_t)(p - s);
    }
    *value = strtod(text, &stop);
    return stop == text + (p - s) ? (size_t)(p - s) : 0;
}

/* Moves to the next token; 0 at the end of the file. */
static int meshio__skip(meshio__reader *r)
{
    const unsigned char *p = r->p;
    for (;;) {
        while (meshio__is_space(*p)) p++;
        if (r->comment && *p == r->comment && p < r->end) {
            p = meshio__line_end(p, r->end);
            continue;
        }
        break;
    }
    r->p = p;
    return p < r->end;
}

/* The token at the cursor, for messages: printable, cut at 24 characters. */
static const char *meshio__shown(const meshio__reader *r, char shown[32])
{
    int i;
    const unsigned char *p = r->p;
    for (i = 0; i < 24 && p < r->end && !meshio__is_space(*p); i++, p++)
        shown[i] = *p >= 32 && *p < 127 ? (char)*p : '?';
    shown[i] = 0;
    if (i == 24) memcpy(shown + i, "...", 4);
    return shown;
}

/* Fails as `what` was expected at the cursor: with SYNTAX, or with TRUNCATED at the end of the
 * file. */
static meshio_result meshio__expected(meshio__reader *r, const char *what)
{
    char shown[32];
    if (r->p >= r->end)
        return meshio__fail(r, MESHIO_ERROR_TRUNCATED, r->p, "the file ends where %s is due", what);
    return meshio__fail(r, MESHIO_ERROR_SYNTAX, r->p, "expected %s, found '%s'", what,
                        meshio__shown(r, shown));
}

static meshio_result meshio__double(meshio__reader *r, double *value)
{
    size_t used;
    if (!meshio__skip(r)) return meshio__expected(r, "a number");
    used = meshio_parse_double((const char *)r->p, (size_t)(r->end - r->p), value);
    if (used == 0 || !meshio__is_end(r->p[used])) return meshio__expected(r, "a number");
    r->p += used;
    return MESHIO_OK;
}

static meshio_result meshio__int(meshio__reader *r, int64_t *value)
{
    const unsigned char *p;
    uint64_t v = 0;
    int negative = 0;
    if (!meshio__skip(r)) return meshio__expected(r, "an integer");
    p = r->p;
    if (*p == '-' || *p == '+') negative = *p++ == '-';
    if (!meshio__is_digit(*p)) return meshio__expected(r, "an integer");
    for (; meshio__is_digit(*p); p++) {
        if (v > (UINT64_C(9223372036854775807) - 9) / 10)
            return meshio__expected(r, "an integer below 2^63");
        v = 10 * v + (uint64_t)(*p - '0');
    }
    if (!meshio__is_end(*p)) return meshio__expected(r, "an integer");
    *value = negative ? -(int64_t)v : (int64_t)v;
    r->p = p;
    return MESHIO_OK;
}

/* An integer that some programs write like 3.0; 0 if it is beyond 9e15. */
static meshio_result meshio__int_or_double(meshio__reader *r, int64_t *value)
{
    double d;
    MESHIO__TRY(meshio__double(r, &d));
    if (!(d > -9e15 && d < 9e15)) d = 0;
    *value = (int64_t)d;
    return MESHIO_OK;
}

static meshio_result meshio__xyz(meshio__reader *r, double xyz[3])
{
    MESHIO__TRY(meshio__double(r, &xyz[0]));
    MESHIO__TRY(meshio__double(r, &xyz[1]));
    return meshio__double(r, &xyz[2]);
}

/* Steps over the next word; returns its start. The length is 0 at the end of the file. */
static const unsigned char *meshio__word(meshio__reader *r, size_t *length)
{
    const unsigned char *start;
    meshio__skip(r);
    start = r->p;
    while (r->p < r->end && !meshio__is_space(*r->p)) r->p++;
    *length = (size_t)(r->p - start);
    return start;
}

/* Steps over a word that must come next; it is given in lower case and may have any in the file. */
static meshio_result meshio__expect(meshio__reader *r, const char *word)
{
    size_t length;
    const unsigned char *start = meshio__word(r, &length);
    char what[40];
    if (length && meshio__same(start, length, word)) return MESHIO_OK;
    r->p = start;
    snprintf(what, sizeof what, "'%s'", word);
    return meshio__expected(r, what);
}

/* Steps over blanks within a line, and over a backslash that continues it on the next line. Returns
 * whether anything but a comment follows on the line. */
static int meshio__more_on_line(meshio__reader *r)
{
    const unsigned char *p = r->p;
    for (;;) {
        if (*p == ' ' || *p == '\t' || *p == '\v' || *p == '\f')
            p++;
        else if (*p == '\r' && p[1] == '\n')
            p++;
        else if (*p == '\\' && (p[1] == '\n' || (p[1] == '\r' && p[2] == '\n')))
            p += p[1] == '\n' ? 2 : 3;
        else
            break;
    }
    r->p = p;
    return p < r->end && *p != '\n' && *p != '\r' && (!r->comment || *p != r->comment);
}

static void meshio__next_line(meshio__reader *r)
{
    r->p = meshio__line_end(r->p, r->end);
    if (r->p < r->end) r->p += *r->p == '\r' && r->p[1] == '\n' ? 2 : 1;
}

/* Copies the rest of the line into the mesh's name. */
static void meshio__take_name(meshio__reader *r)
{
    size_t n = 0;
    while (*r->p == ' ' || *r->p == '\t') r->p++;
    for (; r->p < r->end && *r->p != '\n' && *r->p != '\r'; r->p++)
        if (n + 1 < sizeof r->mesh->name && *r->p >= 32) r->mesh->name[n++] = (char)*r->p;
    while (n > 0 && r->mesh->name[n - 1] == ' ') n--;
    r->mesh->name[n] = 0;
}

/* ---- >>binary  bounded reads, byte order --------------------------------------------------- */

static int meshio__little_endian(void)
{
    const uint16_t one = 1;
    unsigned char first;
    memcpy(&first, &one, 1);
    return first == 1;
}

static meshio_result meshio__bytes(meshio__reader *r, void *out, size_t size)
{
    unsigned char *o = (unsigned char *)out;
    size_t i;
    if ((size_t)(r->end - r->p) < size)
        return meshio__fail(r, MESHIO_ERROR_TRUNCATED, r->p, "the file ends in its binary data");
    for (i = 0; i < size && i < 8; i++) o[i] = r->p[r->swap ? size - 1 - i : i];
    r->p += size;
    return MESHIO_OK;
}

static meshio_result meshio__i32(meshio__reader *r, int64_t *value)
{
    int32_t v = 0;
    MESHIO__TRY(meshio__bytes(r, &v, 4));
    *value = v;
    return MESHIO_OK;
}

static meshio_result meshio__i64(meshio__reader *r, int64_t *value)
{
    return meshio__bytes(r, value, 8);
}

static meshio_result meshio__f64(meshio__reader *r, double *value)
{
    return meshio__bytes(r, value, 8);
}

static size_t meshio__type_size(meshio__type type)
{
    static const unsigned char size[] = {1, 1, 2, 2, 4, 4, 8, 8, 4, 8, 0};
    return size[type];
}

/* The type that a PLY, VTK or VTU file names. */
static meshio__type meshio__type_named(const unsigned char *name, size_t length)
{
    static const struct {
        const char *name;
        meshio__type type;
    } names[] = {{"char", MESHIO__I8},           {"int8", MESHIO__I8},
                 {"uchar", MESHIO__U8},          {"uint8", MESHIO__U8},
                 {"unsigned_char", MESHIO__U8},  {"short", MESHIO__I16},
                 {"int16", MESHIO__I16},         {"ushort", MESHIO__U16},
                 {"uint16", MESHIO__U16},        {"unsigned_short", MESHIO__U16},
                 {"int", MESHIO__I32},           {"int32", MESHIO__I32},
                 {"uint", MESHIO__U32},          {"uint32", MESHIO__U32},
                 {"unsigned_int", MESHIO__U32},  {"int64", MESHIO__I64},
                 {"uint64", MESHIO__U64},        {"long", MESHIO__I64},
                 {"unsigned_long", MESHIO__U64}, {"vtkidtype", MESHIO__I32},
                 {"signed_char", MESHIO__I8},
                 {"float", MESHIO__F32},         {"float32", MESHIO__F32},
                 {"double", MESHIO__F64},        {"float64", MESHIO__F64}};
    size_t i;
    if (length > 7 && meshio__same(name, 7, "vtktype")) { /* vtktypeint64 and the like */
        name += 7;
        length -= 7;
    }
    for (i = 0; i < sizeof names / sizeof names[0]; i++)
        if (meshio__same(name, length, names[i].name)) return names[i].type;
    return MESHIO__NO_TYPE;
}

/* Reads one scalar of the given type, in text or binary, as a double and as an integer. */
static meshio_result meshio__scalar(meshio__reader *r, int binary, meshio__type type, double *d,
                                    int64_t *i)
{
    unsigned char raw[8];
    if (!binary) {
        if (type >= MESHIO__F32) {
            MESHIO__TRY(meshio__double(r, d));
            *i = *d > -9e15 && *d < 9e15 ? (int64_t)*d : -1;
        } else {
            MESHIO__TRY(meshio__int(r, i));
            *d = (double)*i;
        }
        return MESHIO_OK;
    }
    MESHIO__TRY(meshio__bytes(r, raw, meshio__type_size(type)));
    switch (type) {
#define MESHIO__CASE(name, ctype)                                                                  \
    case name: {                                                                                   \
        ctype v;                                                                                   \
        memcpy(&v, raw, sizeof v);                                                                 \
        *d = (double)v;                                                                            \
        *i = (int64_t)v;                                                                           \
    } break;
        MESHIO__CASE(MESHIO__I8, int8_t)
        MESHIO__CASE(MESHIO__U8, uint8_t)
        MESHIO__CASE(MESHIO__I16, int16_t)
        MESHIO__CASE(MESHIO__U16, uint16_t)
        MESHIO__CASE(MESHIO__I32, int32_t)
        MESHIO__CASE(MESHIO__U32, uint32_t)
        MESHIO__CASE(MESHIO__I64, int64_t)
        MESHIO__CASE(MESHIO__U64, uint64_t)
#undef MESHIO__CASE
    case MESHIO__F32: {
        float v;
        memcpy(&v, raw, sizeof v);
        *d = (double)v;
        *i = v > -9e15f && v < 9e15f ? (int64_t)v : -1;
    } break;
    default: {
        double v;
        memcpy(&v, raw, sizeof v);
        *d = v;
        *i = v > -9e15 && v < 9e15 ? (int64_t)v : -1;
    } break;
    }
    return MESHIO_OK;
}

/* ---- >>facets  planar facets with holes and several loops, cut into triangles -------------- */

/* The triangulation of a facet in its plane. Points are in lexicographic order. Triangle t has the
 * corners v[3t..]; n[3t+i] is its neighbour opposite corner i, NONE if there is none. Bit i of
 * fixed[t] is set if its side opposite corner i lies on a segment of the facet; gone[t], if it is
 * not part of the facet. The hull is a circular list while the sweep runs. */
typedef struct meshio__facet {
    size_t num_points, num_segments, num_triangles;
    double *uv;             /* 2 * num_points */
    uint32_t *id;           /* of each point, the vertex of the mesh */
    uint32_t *segments;     /* 2 * num_segments: their end points */
    uint32_t *v, *n;        /* 3 * 2 * num_points */
    uint32_t *of;           /* a triangle of each point */
    uint32_t *next, *prev;  /* the hull, counter-clockwise */
    uint32_t *out;          /* the triangle inside the hull's side (point, next) */
    unsigned char *fixed, *gone;
} meshio__facet;

#define MESHIO__NONE 0xFFFFFFFFu

/* Sum and product with their rounding errors: s + error == a + b, p + error == a * b, exactly. */
static double meshio__two_sum(double a, double b, double *error)
{
    double s = a + b, bb = s - a;
    *error = (a - (s - bb)) + (b - bb);
    return s;
}

static double meshio__two_product(double a, double b, double *error)
{
    const double splitter = 134217729.0;
    volatile double p = a * b, c = splitter * a; /* rounded before use: no FMA */
    double ah = c - (c - a), al = a - ah, bh, bl;
    c = splitter * b;
    bh = c - (c - b);
    bl = b - bh;
    *error = ((ah * bh - p) + ah * bl + al * bh) + al * bl;
    return p;
}

/* A coordinate of a facet, or of a point in a hole, in the facet's plane. Facets are larger than
 * 1e-125 and within 1e150 of 0; products of smaller or larger numbers than these would not be
 * exact. */
static double meshio__coordinate(double x)
{
    return fabs(x) < 1e-140 ? 0 : x > 1e150 ? 1e150 : x < -1e150 ? -1e150 : x;
}

/* Exact sign of the area of triangle (a, b, c), whose coordinates are 0 or between 1e-140 and
 * 1e150: the sum of six products, as an expansion of twelve terms. */
static int meshio__orient2d_exact(const double *a, const double *b, const double *c)
{
    double x[6], y[6], e[16], product[2], q, h;
    int i, j, k, num = 0;
    x[0] = a[0], y[0] = b[1];
    x[1] = -a[1], y[1] = b[0];
    x[2] = b[0], y[2] = c[1];
    x[3] = -b[1], y[3] = c[0];
    x[4] = c[0], y[4] = a[1];
    x[5] = -c[1], y[5] = a[0];
    for (i = 0; i < 6; i++) {
        product[1] = meshio__two_product(x[i], y[i], &product[0]);
        for (k = 0; k < 2; k++) { /* grow the expansion by one term */
            q = product[k];
            for (j = 0; j < num; j++) {
                q = meshio__two_sum(q, e[j], &h);
                e[j] = h;
            }
            e[num++] = q;
        }
    }
    for (j = num - 1; j >= 0; j--)
        if (e[j] != 0) return e[j] > 0 ? 1 : -1;
    return 0;
}

static int meshio__orient2d(const double *a, const double *b, const double *c)
{
    double l = (a[0] - c[0]) * (b[1] - c[1]), r = (a[1] - c[1]) * (b[0] - c[0]), det = l - r;
    double bound = 4e-16 * (fabs(l) + fabs(r)) + 1e-290; /* smaller products may be rounded to 0 */
    if (det > bound) return 1;
    if (det < -bound) return -1;
    return meshio__orient2d_exact(a, b, c);
}

static int meshio__turn(const meshio__facet *f, uint32_t a, uint32_t b, uint32_t c)
{
    return meshio__orient2d(f->uv + 2 * a, f->uv + 2 * b, f->uv + 2 * c);
}

static int meshio__corner_of(const meshio__facet *f, uint32_t t, uint32_t point)
{
    return f->v[3 * t] == point ? 0 : f->v[3 * t + 1] == point ? 1 : 2;
}

static int meshio__side_to(const meshio__facet *f, uint32_t t, uint32_t neighbour)
{
    return f->n[3 * t] == neighbour ? 0 : f->n[3 * t + 1] == neighbour ? 1 : 2;
}

static uint32_t meshio__facet_add(meshio__facet *f, uint32_t a, uint32_t b, uint32_t c)
{
    uint32_t t = (uint32_t)f->num_triangles++;
    f->v[3 * t] = a;
    f->v[3 * t + 1] = b;
    f->v[3 * t + 2] = c;
    f->n[3 * t] = f->n[3 * t + 1] = f->n[3 * t + 2] = MESHIO__NONE;
    f->fixed[t] = f->gone[t] = 0;
    f->of[a] = f->of[b] = f->of[c] = t;
    return t;
}

static void meshio__facet_link(meshio__facet *f, uint32_t t, int i, uint32_t u, int j)
{
    if (t != MESHIO__NONE) f->n[3 * t + (uint32_t)i] = u;
    if (u != MESHIO__NONE) f->n[3 * u + (uint32_t)j] = t;
}

/* Adds point p, outside the hull, with a triangle on each side of the hull that is visible from p;
 * `from` is a point of the hull at one of these sides. 0 if there is none, or no end of them. */
static int meshio__facet_sweep(meshio__facet *f, uint32_t from, uint32_t p)
{
    uint32_t a = from, b, t, last = MESHIO__NONE, first = MESHIO__NONE, steps = 0;
    while (meshio__turn(f, f->prev[a], a, p) < 0 && steps++ < p) a = f->prev[a];
    for (b = a; meshio__turn(f, b, f->next[b], p) < 0; b = f->next[b]) {
        uint32_t inner = f->out[b];
        int i = meshio__corner_of(f, inner, b);
        if (f->num_triangles == 2 * f->num_points) return 0;
        t = meshio__facet_add(f, p, f->next[b], b);
        meshio__facet_link(f, t, 0, inner, (i + 2) % 3); /* the side (b, next) is opposite i + 2 */
        if (last != MESHIO__NONE) meshio__facet_link(f, t, 1, last, 2);
        if (first == MESHIO__NONE) first = t;
        last = t;
    }
    if (first == MESHIO__NONE) return 0;
    f->next[a] = p;
    f->prev[p] = a;
    f->next[p] = b;
    f->prev[b] = p;
    f->out[a] = first;
    f->out[p] = last;
    return 1;
}

/* Triangulates the convex hull of the points. 0 if all are collinear or two are equal. */
static int meshio__facet_hull(meshio__facet *f)
{
    uint32_t n = (uint32_t)f->num_points, k, i, t, before = MESHIO__NONE;
    int sign = 0;
    for (i = 1; i < n; i++)
        if (f->uv[2 * i] == f->uv[2 * i - 2] && f->uv[2 * i + 1] == f->uv[2 * i - 1]) return 0;
    for (k = 2; k < n && (sign = meshio__turn(f, 0, 1, k)) == 0; k++) {}
    if (k >= n) return 0;
    for (i = 0; i + 1 < k; i++) { /* points 0 .. k-1 are collinear, k is not on their line */
        t = sign > 0 ? meshio__facet_add(f, i, i + 1, k) : meshio__facet_add(f, i + 1, i, k);
        if (before != MESHIO__NONE)
            meshio__facet_link(f, t, sign > 0 ? 1 : 0, before, sign > 0 ? 0 : 1);
        before = t;
        if (sign > 0) {
            f->next[i] = i + 1;
            f->prev[i + 1] = i;
            f->out[i] = t;
        } else {
            f->next[i + 1] = i;
            f->prev[i] = i + 1;
            f->out[i + 1] = t;
        }
    }
    i = sign > 0 ? k - 1 : 0;
    f->next[i] = k;
    f->prev[k] = i;
    f->out[i] = sign > 0 ? before : 0;
    i = sign > 0 ? 0 : k - 1;
    f->next[k] = i;
    f->prev[i] = k;
    f->out[k] = sign > 0 ? 0 : before;
    for (i = k + 1; i < n; i++) {
        uint32_t from = i - 1;
        if (meshio__turn(f, from, f->next[from], i) >= 0) from = f->prev[from];
        if (!meshio__facet_sweep(f, from, i)) return 0;
    }
    return 1;
}

/* The next triangle around point a after t, counter-clockwise or clockwise. */
static uint32_t meshio__facet_turn(const meshio__facet *f, uint32_t t, uint32_t a, int clockwise)
{
    int i = meshio__corner_of(f, t, a);
    return f->n[3 * t + (uint32_t)((i + (clockwise ? 2 : 1)) % 3)];
}

/* The triangle to the left of the directed side (a, b), NONE if there is none; *i is the corner
 * opposite the side. If b is NONE: the triangle at a that the ray from a to `goal` enters through
 * its interior; *i is then the corner at a. */
static uint32_t meshio__facet_find(const meshio__facet *f, uint32_t a, uint32_t b, uint32_t goal,
                                   int *i)
{
    uint32_t start = f->of[a], t = start;
    int clockwise;
    for (clockwise = 0; clockwise < 2; clockwise++) {
        t = clockwise ? meshio__facet_turn(f, start, a, 1) : start;
        while (t != MESHIO__NONE) {
            uint32_t c = (uint32_t)meshio__corner_of(f, t, a);
            uint32_t p = f->v[3 * t + (c + 1) % 3], q = f->v[3 * t + (c + 2) % 3];
            *i = (int)((c + 2) % 3);
            if (b != MESHIO__NONE && p == b) return t;
            if (b == MESHIO__NONE) {
                *i = (int)c;
                if (meshio__turn(f, a, p, goal) > 0 && meshio__turn(f, a, goal, q) > 0) return t;
            }
            t = meshio__facet_turn(f, t, a, clockwise);
            if (t == start) return MESHIO__NONE;
        }
    }
    return MESHIO__NONE;
}

/* Flips the side opposite corner i of t: it becomes the other diagonal of the quadrilateral. */
static void meshio__facet_flip(meshio__facet *f, uint32_t t, int i)
{
    uint32_t k = (uint32_t)i, u = f->n[3 * t + k], j = (uint32_t)meshio__side_to(f, u, t);
    uint32_t a = f->v[3 * t + k], b = f->v[3 * t + (k + 1) % 3], c = f->v[3 * t + (k + 2) % 3];
    uint32_t d = f->v[3 * u + j];
    uint32_t ab = f->n[3 * t + (k + 2) % 3], ca = f->n[3 * t + (k + 1) % 3];
    uint32_t bd = f->n[3 * u + (j + 1) % 3], dc = f->n[3 * u + (j + 2) % 3];
    int fab = f->fixed[t] >> ((k + 2) % 3) & 1, fca = f->fixed[t] >> ((k + 1) % 3) & 1;
    int fbd = f->fixed[u] >> ((j + 1) % 3) & 1, fdc = f->fixed[u] >> ((j + 2) % 3) & 1;
    int sbd = bd == MESHIO__NONE ? 0 : meshio__side_to(f, bd, u);
    int sca = ca == MESHIO__NONE ? 0 : meshio__side_to(f, ca, t);
    int sab = ab == MESHIO__NONE ? 0 : meshio__side_to(f, ab, t);
    int sdc = dc == MESHIO__NONE ? 0 : meshio__side_to(f, dc, u);
    f->v[3 * t] = a, f->v[3 * t + 1] = b, f->v[3 * t + 2] = d;
    f->v[3 * u] = a, f->v[3 * u + 1] = d, f->v[3 * u + 2] = c;
    meshio__facet_link(f, t, 0, bd, sbd);
    meshio__facet_link(f, t, 2, ab, sab);
    meshio__facet_link(f, u, 0, dc, sdc);
    meshio__facet_link(f, u, 1, ca, sca);
    meshio__facet_link(f, t, 1, u, 2);
    f->fixed[t] = (unsigned char)(fbd | fab << 2);
    f->fixed[u] = (unsigned char)(fdc | fca << 1);
    f->of[a] = f->of[b] = f->of[d] = t;
    f->of[c] = u;
}

static void meshio__facet_fix(meshio__facet *f, uint32_t t, int i)
{
    uint32_t u = f->n[3 * t + (uint32_t)i];
    f->fixed[t] = (unsigned char)(f->fixed[t] | 1 << i);
    if (u != MESHIO__NONE)
        f->fixed[u] = (unsigned char)(f->fixed[u] | 1 << meshio__side_to(f, u, t));
}

/* A neighbour of point a that lies on the ray from a to b; NONE if there is none. */
static uint32_t meshio__facet_ahead(const meshio__facet *f, uint32_t a, uint32_t b)
{
    double du = f->uv[2 * b] - f->uv[2 * a], dv = f->uv[2 * b + 1] - f->uv[2 * a + 1];
    int clockwise, k;
    for (clockwise = 0; clockwise < 2; clockwise++) {
        uint32_t t = f->of[a];
        do {
            for (k = 0; k < 3; k++) {
                uint32_t w = f->v[3 * t + (uint32_t)k];
                double along = (f->uv[2 * w] - f->uv[2 * a]) * du;
                along += (f->uv[2 * w + 1] - f->uv[2 * a + 1]) * dv;
                if (w != a && along > 0 && meshio__turn(f, a, b, w) == 0) return w;
            }
            t = meshio__facet_turn(f, t, a, clockwise);
        } while (t != MESHIO__NONE && t != f->of[a]);
    }
    return MESHIO__NONE;
}

/* Lists the sides that the open segment (a, b) crosses, as pairs of points, up to the first point
 * that is on it (b or a point before b), which is returned. NONE if it crosses a fixed side or
 * memory runs out. */
static uint32_t meshio__facet_crossed(const meshio__facet *f, uint32_t a, uint32_t b,
                                      meshio__u32s *queue)
{
    int i;
    uint32_t t = meshio__facet_find(f, a, MESHIO__NONE, b, &i);
    queue->num = 0;
    while (t != MESHIO__NONE) {
        uint32_t p = f->v[3 * t + (uint32_t)(i + 1) % 3], q = f->v[3 * t + (uint32_t)(i + 2) % 3];
        uint32_t u = f->n[3 * t + (uint32_t)i], d;
        int side;
        if (u == MESHIO__NONE || (f->fixed[t] >> i & 1)) return MESHIO__NONE;
        if (!meshio__push32(queue, p) || !meshio__push32(queue, q)) return MESHIO__NONE;
        d = f->v[3 * u + (uint32_t)meshio__side_to(f, u, t)];
        side = meshio__turn(f, a, b, d);
        if (side == 0) return d;
        /* p is right of the segment and q left of it; it leaves u through (p, d) or (d, q) */
        i = meshio__corner_of(f, u, side > 0 ? q : p);
        t = u;
    }
    return MESHIO__NONE;
}

/* Flips the listed sides until none crosses the segment (a, b). A side whose quadrilateral is not
 * convex, and a new diagonal that still crosses, go to the end of the queue [Sloan 1993]. 0 if this
 * takes too many steps or memory runs out. */
static int meshio__facet_uncross(meshio__facet *f, uint32_t a, uint32_t b, meshio__u32s *queue)
{
    size_t head = 0, sides = queue->num / 2, budget = 64 + 16 * sides * sides;
    for (; head < queue->num; head += 2) {
        uint32_t p = queue->data[head], q = queue->data[head + 1], apex, d, u, t;
        int i, again = 1;
        if (budget-- == 0) return 0;
        t = meshio__facet_find(f, p, q, 0, &i);
        if (t == MESHIO__NONE) return 0;
        u = f->n[3 * t + (uint32_t)i];
        apex = f->v[3 * t + (uint32_t)i];
        d = f->v[3 * u + (uint32_t)meshio__side_to(f, u, t)];
        if (meshio__turn(f, apex, p, d) > 0 && meshio__turn(f, apex, d, q) > 0) {
            meshio__facet_flip(f, t, i);
            p = apex;
            q = d;
            again = p != a && p != b && q != a && q != b &&
                    meshio__turn(f, a, b, p) * meshio__turn(f, a, b, q) < 0;
        }
        if (again && (!meshio__push32(queue, p) || !meshio__push32(queue, q))) return 0;
    }
    return 1;
}

/* Makes the segment (a, b) a chain of sides and marks them as fixed. 0 if another segment crosses
 * it, or memory runs out. */
static int meshio__facet_recover(meshio__facet *f, uint32_t a, uint32_t b, meshio__u32s *queue)
{
    while (a != b) {
        uint32_t stop = meshio__facet_ahead(f, a, b), t;
        int i;
        if (stop == MESHIO__NONE) {
            stop = meshio__facet_crossed(f, a, b, queue);
            if (stop == MESHIO__NONE || !meshio__facet_uncross(f, a, stop, queue)) return 0;
        }
        t = meshio__facet_find(f, a, stop, 0, &i);
        if (t == MESHIO__NONE) t = meshio__facet_find(f, stop, a, 0, &i);
        if (t == MESHIO__NONE) return 0;
        meshio__facet_fix(f, t, i);
        a = stop;
    }
    return 1;
}

/* Marks t, and all triangles that can be reached from it without crossing a segment, as gone. 0 if
 * memory runs out. */
static int meshio__facet_eat(meshio__facet *f, uint32_t t, meshio__u32s *stack)
{
    int i;
    if (f->gone[t]) return 1;
    stack->num = 0;
    f->gone[t] = 1;
    if (!meshio__push32(stack, t)) return 0;
    while (stack->num) {
        t = stack->data[--stack->num];
        for (i = 0; i < 3; i++) {
            uint32_t u = f->n[3 * t + (uint32_t)i];
            if (u == MESHIO__NONE || f->gone[u] || (f->fixed[t] >> i & 1)) continue;
            f->gone[u] = 1;
            if (!meshio__push32(stack, u)) return 0;
        }
    }
    return 1;
}

/* On how many sides of triangle t is point p: 0 inside, 2 in a corner; -1 if it is beyond a side.
 * *side becomes the corner opposite such a side; `first` is the one that is tried first. */
static int meshio__facet_place(const meshio__facet *f, uint32_t t, const double *p, uint32_t first,
                               uint32_t *side)
{
    const uint32_t *v = f->v + 3 * t;
    uint32_t k;
    int on = 0;
    for (k = first; k < first + 3; k++) {
        int turn = meshio__orient2d(f->uv + 2 * v[(k + 1) % 3], f->uv + 2 * v[(k + 2) % 3], p);
        if (turn <= 0) *side = k % 3;
        if (turn < 0) return -1;
        on += turn == 0;
    }
    return on;
}

/* The first triangle that has point p in it or on its border; NONE if none has. Walks from triangle
 * *from towards p, and tries all triangles only if p is a corner, or the walk goes in circles.
 * *from becomes the triangle where the walk ends. */
static uint32_t meshio__facet_locate(const meshio__facet *f, uint32_t *from, const double *p)
{
    uint32_t t = *from, n = (uint32_t)f->num_triangles, steps, side = 0;
    for (steps = 0; steps < n; steps++) {
        int on = meshio__facet_place(f, t, p, steps % 3, &side);
        uint32_t beyond = f->n[3 * t + side];
        *from = t;
        if (on == 0) return t;
        if (on == 1) return beyond < t ? beyond : t;
        if (on == 2) break;
        if (beyond == MESHIO__NONE) return beyond;
        t = beyond;
    }
    for (t = 0; t < n; t++)
        if (meshio__facet_place(f, t, p, 0, &side) >= 0) return t;
    return MESHIO__NONE;
}

/* Removes what is outside the outermost segments, and the region around each hole point (2
 * doubles). 0 if memory runs out. */
static int meshio__facet_carve(meshio__facet *f, const double *holes, size_t num_holes,
                               meshio__u32s *stack)
{
    uint32_t t, n = (uint32_t)f->num_triangles, from = 0;
    size_t h;
    int i;
    for (t = 0; t < n; t++)
        for (i = 0; i < 3; i++)
            if (f->n[3 * t + (uint32_t)i] == MESHIO__NONE && !(f->fixed[t] >> i & 1))
                if (!meshio__facet_eat(f, t, stack)) return 0;
    for (h = 0; h < num_holes; h++) {
        t = meshio__facet_locate(f, &from, holes + 2 * h);
        if (t != MESHIO__NONE && !meshio__facet_eat(f, t, stack)) return 0;
    }
    return 1;
}

/* A facet as it is read: loops of vertices, one after the other, and hole points. */
typedef struct meshio__loops {
    meshio__u32s corners;
    meshio__u64s ends; /* for each loop the index in `corners` after its last one */
    double *holes;     /* 3 each */
    size_t num_holes, cap_holes;
} meshio__loops;

typedef struct meshio__point2 {
    double u, v;
    uint32_t id, local;
} meshio__point2;

static int meshio__compare_points(const void *pa, const void *pb)
{
    const meshio__point2 *a = (const meshio__point2 *)pa, *b = (const meshio__point2 *)pb;
    if (a->u != b->u) return a->u < b->u ? -1 : 1;
    if (a->v != b->v) return a->v < b->v ? -1 : 1;
    return a->id < b->id ? -1 : a->id > b->id;
}

/* The normal of a loop's plane by Newell's method. Returns its largest component's size. */
static double meshio__loop_normal(const double *xyz, const uint32_t *v, size_t n, double normal[3])
{
    size_t i;
    int k;
    double size = 0;
    normal[0] = normal[1] = normal[2] = 0;
    for (i = 0; i < n; i++) {
        const double *a = xyz + 3 * (size_t)v[i], *b = xyz + 3 * (size_t)v[(i + 1) % n];
        const double *o = xyz + 3 * (size_t)v[0];
        for (k = 0; k < 3; k++) {
            int y = (k + 1) % 3, z = (k + 2) % 3;
            normal[k] += (a[y] - o[y]) * (b[z] - o[z]) - (a[z] - o[z]) * (b[y] - o[y]);
        }
    }
    for (k = 0; k < 3; k++)
        if (fabs(normal[k]) > size) size = fabs(normal[k]);
    return size;
}

/* Loop k of a facet; *n becomes the number of its corners. */
static const uint32_t *meshio__loop(const meshio__loops *loops, size_t k, size_t *n)
{
    size_t start = k ? (size_t)loops->ends.data[k - 1] : 0;
    *n = (size_t)loops->ends.data[k] - start;
    return loops->corners.data + start;
}

/* The normal of a facet's plane, from the loop that is taken as the outer one: the first whose area
 * is not 0, nor as good as 0 beside that of the largest loop. */
static void meshio__facet_normal(const double *xyz, const meshio__loops *loops, double normal[3])
{
    double largest = 0, size;
    size_t k, n, num = loops->ends.num;
    const uint32_t *v;
    for (k = 0; num > 1 && k < num; k++) {
        v = meshio__loop(loops, k, &n);
        size = meshio__loop_normal(xyz, v, n, normal);
        if (size > largest) largest = size;
    }
    for (k = 0; k < num; k++) {
        v = meshio__loop(loops, k, &n);
        if (meshio__loop_normal(xyz, v, n, normal) >= 1e-12 * largest) return;
    }
    normal[0] = normal[1] = normal[2] = 0;
}

/* Does a fan from its first corner cover the loop without overlaps? True if the loop is convex, or
 * star-shaped as seen from this corner. `sign`: the loop's orientation in the axes ku, kv. */
static int meshio__facet_is_fan(const double *xyz, const uint32_t *v, size_t n, int ku, int kv,
                                int sign)
{
    double o[2], a[2], b[2], angle = 0;
    size_t i;
    o[0] = meshio__coordinate(xyz[3 * (size_t)v[0] + (size_t)ku]);
    o[1] = meshio__coordinate(xyz[3 * (size_t)v[0] + (size_t)kv]);
    for (i = 1; i + 1 < n; i++) {
        a[0] = meshio__coordinate(xyz[3 * (size_t)v[i] + (size_t)ku]);
        a[1] = meshio__coordinate(xyz[3 * (size_t)v[i] + (size_t)kv]);
        b[0] = meshio__coordinate(xyz[3 * (size_t)v[i + 1] + (size_t)ku]);
        b[1] = meshio__coordinate(xyz[3 * (size_t)v[i + 1] + (size_t)kv]);
        if (meshio__orient2d(o, a, b) != sign) return 0;
        a[0] -= o[0], a[1] -= o[1], b[0] -= o[0], b[1] -= o[1];
        if (n > 4) /* two triangles cannot go around the corner and overlap */
            angle += atan2(sign * (a[0] * b[1] - a[1] * b[0]), a[0] * b[0] + a[1] * b[1]);
    }
    return angle < 6.28; /* the fan does not go around more than once */
}

static void meshio__facet_release(meshio__facet *f)
{
    MESHIO_FREE(f->uv);
    MESHIO_FREE(f->id);
    MESHIO_FREE(f->segments);
    MESHIO_FREE(f->v);
    MESHIO_FREE(f->n);
    MESHIO_FREE(f->of);
    MESHIO_FREE(f->next);
    MESHIO_FREE(f->prev);
    MESHIO_FREE(f->out);
    MESHIO_FREE(f->fixed);
    MESHIO_FREE(f->gone);
}

static int meshio__facet_reserve(meshio__facet *f, size_t points, size_t segments)
{
    memset(f, 0, sizeof *f);
    f->uv = (double *)MESHIO_MALLOC(2 * points * sizeof(double));
    f->id = (uint32_t *)MESHIO_MALLOC(points * sizeof(uint32_t));
    f->segments = (uint32_t *)MESHIO_MALLOC((2 * segments + 1) * sizeof(uint32_t));
    f->v = (uint32_t *)MESHIO_MALLOC(6 * points * sizeof(uint32_t));
    f->n = (uint32_t *)MESHIO_MALLOC(6 * points * sizeof(uint32_t));
    f->of = (uint32_t *)MESHIO_MALLOC(points * sizeof(uint32_t));
    f->next = (uint32_t *)MESHIO_MALLOC(points * sizeof(uint32_t));
    f->prev = (uint32_t *)MESHIO_MALLOC(points * sizeof(uint32_t));
    f->out = (uint32_t *)MESHIO_MALLOC(points * sizeof(uint32_t));
    f->fixed = (unsigned char *)MESHIO_MALLOC(2 * points);
    f->gone = (unsigned char *)MESHIO_MALLOC(2 * points);
    return f->uv && f->id && f->segments && f->v && f->n && f->of && f->next && f->prev && f->out &&
           f->fixed && f->gone;
}

/* Fills in the points (sorted, each vertex once) and the segments from the loops. 0 if memory runs
 * out. */
static int meshio__facet_fill(meshio__facet *f, const double *xyz, const meshio__loops *loops,
                              int ku, int kv)
{
    size_t n = loops->corners.num, i, k, start = 0;
    const int fits = n <= (size_t)-1 / 32; /* products here and in meshio__facet_reserve */
    meshio__point2 *points = fits ? (meshio__point2 *)MESHIO_MALLOC(n * sizeof *points) : NULL;
    uint32_t *local = fits ? (uint32_t *)MESHIO_MALLOC(n * sizeof *local) : NULL;
    int ok = points && local && meshio__facet_reserve(f, n, n);
    for (i = 0; ok && i < n; i++) {
        points[i].id = loops->corners.data[i];
        points[i].local = (uint32_t)i;
        points[i].u = meshio__coordinate(xyz[3 * (size_t)points[i].id + (size_t)ku]);
        points[i].v = meshio__coordinate(xyz[3 * (size_t)points[i].id + (size_t)kv]);
    }
    if (ok) qsort(points, n, sizeof *points, meshio__compare_points);
    for (i = 0; ok && i < n; i++) {
        if (i == 0 || points[i].id != points[i - 1].id) {
            f->uv[2 * f->num_points] = points[i].u;
            f->uv[2 * f->num_points + 1] = points[i].v;
            f->id[f->num_points++] = points[i].id;
        }
        local[points[i].local] = (uint32_t)(f->num_points - 1);
    }
    for (k = 0; ok && k < loops->ends.num; k++) {
        size_t end = (size_t)loops->ends.data[k], sides = end - start;
        if (sides == 1) sides = 0; /* an isolated point */
        if (sides == 2) sides = 1; /* a single segment */
        for (i = 0; i < sides; i++) {
            f->segments[2 * f->num_segments] = local[start + i];
            f->segments[2 * f->num_segments++ + 1] =
                local[start + i + 1 < end ? start + i + 1 : start];
        }
        start = end;
    }
    MESHIO_FREE(points);
    MESHIO_FREE(local);
    return ok;
}

/* Chooses the coordinate plane to project a facet into: the axes ku, kv, and the orientation of the
 * outer loop there. 0 if no loop has an area or a coordinate is too large. */
static int meshio__facet_plane(const double *xyz, const meshio__loops *loops, int *ku, int *kv,
                               int *sign)
{
    const uint32_t *v = loops->corners.data;
    double normal[3];
    size_t i;
    int k = 0;
    meshio__facet_normal(xyz, loops, normal);
    if (fabs(normal[1]) > fabs(normal[k])) k = 1;
    if (fabs(normal[2]) > fabs(normal[k])) k = 2;
    *ku = (k + 1) % 3;
    *kv = (k + 2) % 3;
    *sign = normal[k] > 0 ? 1 : -1;
    if (!(fabs(normal[k]) > 1e-250)) return 0;
    for (i = 0; i < 3 * loops->corners.num; i++)
        if (!(fabs(xyz[3 * (size_t)v[i / 3] + i % 3]) < 1e150)) return 0;
    return 1;
}

/* Polygons with more corners keep their fan: the work of cutting one may be quadratic. */
enum { MESHIO__CORNERS = 1000 };

/* A loop may run to a hole, around it, and back on the same way. The two segments of such a bridge
 * are no border of the facet and are removed. */
static void meshio__facet_drop_bridges(meshio__facet *f)
{
    uint32_t *s = f->segments;
    size_t i, j;
    for (i = 0; i < f->num_segments; i++)
        for (j = i + 1; j < f->num_segments; j++) {
            if (s[2 * i] != s[2 * j + 1] || s[2 * i + 1] != s[2 * j]) continue;
            memmove(s + 2 * j, s + 2 * (j + 1), 2 * (f->num_segments - j - 1) * sizeof *s);
            memmove(s + 2 * i, s + 2 * (i + 1), 2 * (f->num_segments - i - 2) * sizeof *s);
            f->num_segments -= 2;
            i--;
            break;
        }
}

/* Removes what is on the outer side of the segments of a loop with this orientation; this includes
 * holes that bridges connect to it. 0 if memory runs out. */
static int meshio__facet_eat_beyond(meshio__facet *f, int sign, meshio__u32s *stack)
{
    size_t i;
    int corner;
    for (i = 0; i < f->num_segments; i++) {
        uint32_t a = f->segments[2 * i], b = f->segments[2 * i + 1], t;
        t = sign > 0 ? meshio__facet_find(f, b, a, 0, &corner)
                     : meshio__facet_find(f, a, b, 0, &corner);
        if (t != MESHIO__NONE && !meshio__facet_eat(f, t, stack)) return 0;
    }
    return 1;
}

/* Cuts a facet into triangles, counter-clockwise in the axes ku, kv. *ok becomes 0 if that is not
 * possible: segments cross, or points coincide. Returns 0 if memory runs out. */
static int meshio__facet_cut(meshio__facet *f, const double *xyz, const meshio__loops *loops,
                             const double *holes, int ku, int kv, int sign,
                             meshio__u32s *scratch, int *ok)
{
    size_t i;
    int plain = loops->ends.num == 1 && loops->num_holes == 0;
    *ok = 1;
    if (!meshio__facet_fill(f, xyz, loops, ku, kv)) return 0;
    plain = plain && f->num_segments <= MESHIO__CORNERS;
    if (plain) meshio__facet_drop_bridges(f);
    *ok = meshio__facet_hull(f);
    for (i = 0; *ok && i < f->num_segments; i++)
        *ok = meshio__facet_recover(f, f->segments[2 * i], f->segments[2 * i + 1], scratch);
    if (!*ok) return !scratch->failed;
    return meshio__facet_carve(f, holes, loops->num_holes, scratch) &&
           (!plain || meshio__facet_eat_beyond(f, sign, scratch));
}

/* The vertices of triangle t of a facet, oriented as its outer loop. */
static void meshio__facet_corners(const meshio__facet *f, size_t t, int sign, uint32_t *out)
{
    out[0] = f->id[f->v[3 * t]];
    out[1] = f->id[f->v[3 * t + (sign > 0 ? 1 : 2)]];
    out[2] = f->id[f->v[3 * t + (sign > 0 ? 2 : 1)]];
}

/* Does a facet consist of points and segments only? */
static int meshio__facet_is_thin(const meshio__loops *loops)
{
    size_t k, n;
    for (k = 0; k < loops->ends.num; k++) {
        meshio__loop(loops, k, &n);
        if (n >= 3) return 0;
    }
    return 1;
}

/* Adds the triangles of a facet to the mesh, oriented as its outer loop. */
static meshio_result meshio__add_facet(meshio__reader *r, const unsigned char *where,
                                       meshio__loops *loops, int64_t tag)
{
    meshio_mesh *m = r->mesh;
    const uint32_t *v = loops->corners.data;
    size_t n = loops->ends.num ? (size_t)loops->ends.data[0] : 0, i;
    int plain = loops->ends.num == 1 && loops->num_holes == 0, ku, kv, sign, ok;
    meshio_result result = MESHIO_OK;
    meshio__facet f;
    memset(&f, 0, sizeof f);
    if (plain && n == 3) return meshio__add_polygon(r, v, n, tag);
    if (meshio__facet_is_thin(loops)) { /* segments; the points are vertices already */
        for (i = 0; i < loops->ends.num; i++) {
            v = meshio__loop(loops, i, &n);
            if (n == 2) MESHIO__TRY(meshio__add_edge(r, v, tag));
        }
        return MESHIO_OK;
    }
    if (!meshio__facet_plane(m->xyz, loops, &ku, &kv, &sign)) {
        if (plain) return meshio__add_polygon(r, v, n, tag);
        return meshio__fail(r, MESHIO_ERROR_SYNTAX, where,
                            "the facet has no area, or coordinates that are too large");
    }
    if (plain && meshio__facet_is_fan(m->xyz, v, n, ku, kv, sign))
        return meshio__add_polygon(r, v, n, tag);
    for (i = 0; i < loops->num_holes; i++) {
        double u = loops->holes[3 * i + (size_t)ku], w = loops->holes[3 * i + (size_t)kv];
        loops->holes[2 * i] = meshio__coordinate(u);
        loops->holes[2 * i + 1] = meshio__coordinate(w);
    }
    if (!meshio__facet_cut(&f, m->xyz, loops, loops->holes, ku, kv, sign, &r->scratch, &ok))
        result = meshio__no_memory(r);
    else if (!ok)
        result = meshio__fail(r, MESHIO_ERROR_SYNTAX, where,
                              "the facet's segments cross, or two of its points coincide");
    for (i = 0; i < f.num_triangles && result == MESHIO_OK; i++) {
        uint32_t t[3];
        meshio__facet_corners(&f, i, sign, t);
        if (!f.gone[i]) result = meshio__add_triangle(r, t[0], t[1], t[2], tag);
    }
    meshio__facet_release(&f);
    return result;
}

/* Replaces the fan of a polygon, if it does not cover the polygon, by a triangulation in the
 * polygon's plane, which has as many triangles. A polygon without such a triangulation, whose sides
 * cross, for example, keeps its fan. */
static meshio_result meshio__cut_polygon(meshio__reader *r, uint32_t *fan, meshio__loops *loop)
{
    const double *xyz = r->mesh->xyz;
    const meshio__u32s *v = &loop->corners;
    size_t i, count = 0;
    int ku, kv, sign, ok;
    meshio__facet f;
    memset(&f, 0, sizeof f);
    if (!meshio__facet_plane(xyz, loop, &ku, &kv, &sign) ||
        meshio__facet_is_fan(xyz, v->data, v->num, ku, kv, sign))
        return MESHIO_OK;
    if (!meshio__facet_cut(&f, xyz, loop, NULL, ku, kv, sign, &r->scratch, &ok)) {
        meshio__facet_release(&f);
        return meshio__no_memory(r);
    }
    for (i = 0; ok && i < f.num_triangles; i++) count += !f.gone[i];
    for (i = 0; count == v->num - 2 && i < f.num_triangles; i++) {
        if (f.gone[i]) continue;
        meshio__facet_corners(&f, i, sign, fan);
        fan += 3;
    }
    meshio__facet_release(&f);
    return MESHIO_OK;
}

/* After everything has been read: replaces the fans of all polygons where necessary, but for those
 * of very many corners. */
static meshio_result meshio__cut_polygons(meshio__reader *r)
{
    meshio__loops loop;
    meshio_result result = MESHIO_OK;
    size_t i, k;
    memset(&loop, 0, sizeof loop);
    for (i = 0; i < r->polygons.num && result == MESHIO_OK; i += 2) {
        uint32_t *fan = r->mesh->triangles + 3 * (size_t)r->polygons.data[i];
        size_t n = (size_t)r->polygons.data[i + 1];
        loop.corners.num = loop.ends.num = 0;
        if (n > MESHIO__CORNERS) continue;
        if (!meshio__push32(&loop.corners, fan[0]) || !meshio__push32(&loop.corners, fan[1]) ||
            !meshio__push64(&loop.ends, n))
            result = meshio__no_memory(r);
        for (k = 2; k < n && result == MESHIO_OK; k++)
            if (!meshio__push32(&loop.corners, fan[3 * (k - 2) + 2])) result = meshio__no_memory(r);
        if (result == MESHIO_OK) result = meshio__cut_polygon(r, fan, &loop);
    }
    MESHIO_FREE(loop.corners.data);
    MESHIO_FREE(loop.ends.data);
    return result;
}

/* ---- >>stl ---------------------------------------------------------------------------------- */

static uint64_t meshio__hash_bits(uint64_t h, double d)
{
    uint64_t bits;
    d += 0.0; /* -0 and +0 are equal */
    memcpy(&bits, &d, 8);
    h = (h ^ bits) * UINT64_C(0x9E3779B97F4A7C15);
    return h ^ h >> 29;
}

static size_t meshio__weld_slot(const meshio__reader *r, const double xyz[3])
{
    uint64_t h = meshio__hash_bits(meshio__hash_bits(meshio__hash_bits(1, xyz[0]), xyz[1]), xyz[2]);
    size_t mask = r->table.cap - 1, slot = (size_t)(h >> 7) & mask;
    for (;; slot = (slot + 1) & mask) {
        const double *q;
        if (r->table.data[slot] == MESHIO__NONE) return slot;
        q = r->mesh->xyz + 3 * (size_t)r->table.data[slot];
        if (q[0] == xyz[0] && q[1] == xyz[1] && q[2] == xyz[2]) return slot;
    }
}

/* Doubles the hash table of vertices (open addressing, at most half full) and refills it. */
static int meshio__weld_grow(meshio__reader *r)
{
    size_t cap = r->table.cap ? 2 * r->table.cap : 1024, v;
    if (cap > (size_t)-1 / sizeof(uint32_t)) return 0;
    MESHIO_FREE(r->table.data);
    r->table.cap = 0;
    r->table.data = (uint32_t *)MESHIO_MALLOC(cap * sizeof(uint32_t));
    if (!r->table.data) return 0;
    r->table.cap = cap;
    memset(r->table.data, 255, cap * sizeof(uint32_t));
    for (v = 0; v < r->mesh->num_vertices; v++)
        r->table.data[meshio__weld_slot(r, r->mesh->xyz + 3 * v)] = (uint32_t)v;
    return 1;
}

/* Finds or adds the vertex with exactly these coordinates. NaN equals nothing, so a corner with NaN
 * becomes a vertex of its own. */
static meshio_result meshio__weld(meshio__reader *r, const double xyz[3], uint32_t *vertex)
{
    size_t slot;
    if (2 * r->mesh->num_vertices >= r->table.cap && !meshio__weld_grow(r))
        return meshio__no_memory(r);
    slot = meshio__weld_slot(r, xyz);
    r->mesh->num_corners++;
    if (r->table.data[slot] == MESHIO__NONE) {
        r->table.data[slot] = (uint32_t)r->mesh->num_vertices;
        MESHIO__TRY(meshio__add_vertex(r, xyz, 0));
    }
    *vertex = r->table.data[slot];
    return MESHIO_OK;
}

static meshio_result meshio__stl_facet(meshio__reader *r, int64_t solid)
{
    double xyz[3];
    size_t length;
    const unsigned char *word;
    int k;
    r->polygon.num = 0;
    word = meshio__word(r, &length);
    if (meshio__same(word, length, "normal")) /* ignored: may be -1.#IND, or missing altogether */
        for (k = 0; k < 3; k++) meshio__word(r, &length);
    else r->p = word;
    if (r->p == word && !meshio__same(word, length, "outer"))
        return meshio__expected(r, "'normal'");
    MESHIO__TRY(meshio__expect(r, "outer"));
    MESHIO__TRY(meshio__expect(r, "loop"));
    for (;;) {
        uint32_t v = 0;
        word = meshio__word(r, &length);
        if (meshio__same(word, length, "endloop")) break;
        if (!meshio__same(word, length, "vertex")) {
            r->p = word;
            return meshio__expected(r, r->polygon.num < 3 ? "'vertex'" : "'endloop'");
        }
        MESHIO__TRY(meshio__xyz(r, xyz));
        MESHIO__TRY(meshio__weld(r, xyz, &v));
        if (!meshio__push32(&r->polygon, v)) return meshio__no_memory(r);
    }
    if (r->polygon.num < 3)
        return meshio__fail(r, MESHIO_ERROR_SYNTAX, word, "a facet with fewer than 3 vertices");
    MESHIO__TRY(meshio__expect(r, "endfacet"));
    return meshio__add_polygon(r, r->polygon.data, r->polygon.num, solid);
}

static meshio_result meshio__read_stl_text(meshio__reader *r)
{
    int64_t solid = 0;
    size_t i;
    r->text = 1;
    while (meshio__skip(r)) {
        MESHIO__TRY(meshio__expect(r, "solid"));
        if (solid++ == 0) meshio__take_name(r);
        meshio__next_line(r);
        for (;;) {
            size_t length;
            const unsigned char *word = meshio__word(r, &length);
            if (meshio__same(word, length, "endsolid")) break;
            if (length == 0 && r->mesh->num_triangles) break; /* some files have no endsolid */
            if (!meshio__same(word, length, "facet")) {
                r->p = word;
                return meshio__expected(r, "'facet' or 'endsolid'");
            }
            MESHIO__TRY(meshio__stl_facet(r, solid));
        }
        meshio__next_line(r);
    }
    if (solid == 1)
        for (i = 0; i < r->mesh->num_triangles; i++) r->mesh->triangle_tags[i] = 0;
    return MESHIO_OK;
}

static uint64_t meshio__stl_count(const unsigned char *header)
{
    uint64_t count = 0;
    int k;
    for (k = 3; k >= 0; k--) count = count << 8 | header[80 + k];
    return count;
}

/* The number of binary solids, one after the other, that make up the whole file; 0 if the file is
 * not of this form. */
static int64_t meshio__stl_solids(const meshio__reader *r)
{
    const unsigned char *p = r->begin;
    int64_t solids = 0;
    for (; r->end - p >= 84; solids++) {
        uint64_t count = meshio__stl_count(p);
        if (count > (uint64_t)(r->end - p - 84) / 50) return 0;
        p += 84 + 50 * count;
    }
    return p == r->end ? solids : 0;
}

static meshio_result meshio__read_stl_binary(meshio__reader *r, uint64_t count, int64_t solid)
{
    uint64_t i;
    int k, c;
    r->p += 84;
    for (i = 0; i < count; i++) {
        float raw[12];
        uint32_t v[3];
        for (k = 0; k < 12; k++) MESHIO__TRY(meshio__bytes(r, &raw[k], 4));
        r->p += 2;
        for (k = 0; k < 3; k++) {
            double xyz[3];
            for (c = 0; c < 3; c++) xyz[c] = (double)raw[3 + 3 * k + c];
            MESHIO__TRY(meshio__weld(r, xyz, &v[k]));
        }
        MESHIO__TRY(meshio__add_triangle(r, v[0], v[1], v[2], solid));
    }
    return MESHIO_OK;
}

/* The file is binary if its size agrees with the counts in it; else text if it begins with "solid"
 * and has no zero byte in its first 1024 bytes; else binary with extra bytes at the end, but not as
 * many as more triangles have. (Many binary files begin with "solid", too.) If the count of a
 * binary file is 0, its size counts: programs that write while they compute do not always go back
 * to it. */
static meshio_result meshio__read_stl(meshio__reader *r)
{
    size_t size = (size_t)(r->end - r->begin), head = size < 1024 ? size : 1024;
    const unsigned char *p = r->begin, *text = r->p; /* text: after a byte order mark */
    uint64_t count = size >= 84 ? meshio__stl_count(p) : 0;
    int64_t solids = meshio__stl_solids(r), i;
    r->swap = !meshio__little_endian();
    r->p = r->begin; /* a binary header may be any bytes */
    if (solids == 1) return meshio__read_stl_binary(r, count, 0);
    for (i = 1; i <= solids; i++)
        MESHIO__TRY(meshio__read_stl_binary(r, meshio__stl_count(r->p), i));
    if (solids) return MESHIO_OK;
    while (meshio__is_space(*text)) text++;
    if (r->end - text >= 5 && meshio__same(text, 5, "solid") && !memchr(r->begin, 0, head)) {
        r->p = text;
        return meshio__read_stl_text(r);
    }
    if (size == 0) return meshio__fail(r, MESHIO_ERROR_TRUNCATED, p, "the file is empty");
    if (size < 84)
        return meshio__fail(r, MESHIO_ERROR_FORMAT, r->begin,
                            "neither \"solid\" nor the 84 bytes of a binary STL header");
    if ((size - 84) / 50 < count)
        return meshio__fail(r, MESHIO_ERROR_COUNT, r->begin + 80,
                            "binary STL claims %llu triangles, but holds at most %llu",
                            (unsigned long long)count, (unsigned long long)((size - 84) / 50));
    if ((size - 84) % 50 == 0 && count == 0)
        count = (size - 84) / 50;
    else if ((size - 84) % 50 == 0 && count < (size - 84) / 50)
        return meshio__fail(r, MESHIO_ERROR_COUNT, r->begin + 80,
                            "binary STL claims %llu triangles, but has the bytes of %llu",
                            (unsigned long long)count, (unsigned long long)((size - 84) / 50));
    return meshio__read_stl_binary(r, count, 0);
}

/* ---- >>off ---------------------------------------------------------------------------------- */

/* Steps over a value, up to a blank or comment. */
static void meshio__pass_value(meshio__reader *r)
{
    const unsigned char *start = r->p;
    double unused;
    while (!meshio__is_end(*r->p)) r->p++;
    if (*r->p == '#' && r->p > start && r->p[-1] == '.') /* 1.#IND */
        r->p = start + meshio_parse_double((const char *)start, (size_t)(r->end - start), &unused);
}

/* Does each vertex have a line of its own, from the next line on, with at least three values, and
 * are there at least as many lines again as there are faces? Then the rest of a vertex's line
 * can be skipped, whatever it means. *odd becomes the first line that has fewer values, if at least
 * half of the vertices have their lines and the file does not end there, else NULL. */
static int meshio__off_has_lines(meshio__reader *r, int64_t vertices, int64_t faces,
                                 const unsigned char **odd)
{
    const unsigned char *start = r->p, *line = NULL;
    int64_t lines = 0, num_odd = 0;
    int k;
    *odd = NULL;
    for (meshio__next_line(r); r->p < r->end && lines < vertices + faces; meshio__next_line(r)) {
        if (!meshio__more_on_line(r)) continue;
        line = r->p;
        for (k = lines++ < vertices ? 0 : 3; k < 3 && meshio__more_on_line(r); k++)
            meshio__pass_value(r);
        if (k < 3 && num_odd++ == 0) *odd = line;
    }
    r->p = start;
    if (2 * num_odd > vertices || *odd == line) *odd = NULL;
    return num_odd == 0 && lines == vertices + faces;
}

/* `extra`: how many numbers follow the coordinates of a vertex; -1: the rest of the line. */
static meshio_result meshio__off_vertices(meshio__reader *r, int64_t count, int extra)
{
    double xyz[3], unused;
    int64_t i;
    int k;
    for (i = 0; i < count; i++) {
        MESHIO__TRY(meshio__xyz(r, xyz));
        for (k = 0; k < extra; k++) MESHIO__TRY(meshio__double(r, &unused));
        if (extra < 0) meshio__next_line(r);
        MESHIO__TRY(meshio__add_vertex(r, xyz, 0));
    }
    return MESHIO_OK;
}

/* Reads the index of a vertex, which counts from `first`, of an element in text. */
static meshio_result meshio__corner(meshio__reader *r, int64_t first, uint32_t *v)
{
    const unsigned char *where;
    int64_t index;
    meshio__skip(r);
    where = r->p;
    MESHIO__TRY(meshio__int(r, &index));
    return meshio__vertex(r, where, index, first, v);
}

/* Reads n vertex indices, which count from `first`, into r->polygon. */
static meshio_result meshio__read_polygon_text(meshio__reader *r, int64_t n, int64_t first)
{
    int64_t i;
    MESHIO__TRY(meshio__fits(r, n, 2, "corners of a polygon"));
    r->polygon.num = 0;
    for (i = 0; i < n; i++) {
        uint32_t v = 0;
        MESHIO__TRY(meshio__corner(r, first, &v));
        if (!meshio__push32(&r->polygon, v)) return meshio__no_memory(r);
    }
    return MESHIO_OK;
}

/* The next word as a number, or -1. */
static int64_t meshio__number(meshio__reader *r)
{
    size_t length, i;
    const unsigned char *word = meshio__word(r, &length);
    int64_t value = 0;
    if (length == 0) return -1;
    for (i = 0; i < length; i++) {
        if (!meshio__is_digit(word[i]) || value > (int64_t)MESHIO__MAX_COUNT) return -1;
        value = 10 * value + (word[i] - '0');
    }
    return value;
}

/* Fails if one more face follows the `count` that the header claims: the number of its corners, and
 * these. Anything else may be there. */
static meshio_result meshio__no_more_faces(meshio__reader *r, int64_t count)
{
    const unsigned char *where;
    int64_t corners, v;
    meshio__skip(r);
    where = r->p;
    corners = meshio__number(r);
    if (corners < 3) return MESHIO_OK;
    for (; corners > 0; corners--) {
        v = meshio__number(r);
        if (v < 0 || v >= (int64_t)r->mesh->num_vertices) return MESHIO_OK;
    }
    return meshio__fail(r, MESHIO_ERROR_COUNT, where, "one more face than the %lld claimed",
                        (long long)count);
}

/* Steps over the number of edges, which some files leave out. */
static meshio_result meshio__off_edges(meshio__reader *r)
{
    const unsigned char *start = r->p, *next;
    int64_t unused;
    if (meshio__more_on_line(r)) return meshio__int(r, &unused);
    meshio__skip(r);
    for (next = r->p; r->p < r->end && !meshio__is_end(*r->p); r->p++) {}
    if (!meshio__more_on_line(r)) { /* one number on the next line: the number of edges */
        r->p = next;
        return meshio__int(r, &unused);
    }
    r->p = start;
    return MESHIO_OK;
}

/* In a file that is not one line, colours may follow the corners on the line of a face. */
static meshio_result meshio__off_faces(meshio__reader *r, int64_t count, int one_line)
{
    const unsigned char *start = NULL, *split = NULL; /* split: the first face of several lines */
    meshio_result result = meshio__fits(r, count, 2, "faces");
    int64_t n, f;
    for (f = 0; f < count && result == MESHIO_OK; f++) {
        meshio__skip(r);
        start = r->p;
        result = meshio__int(r, &n);
        if (result == MESHIO_OK) result = meshio__read_polygon_text(r, n, 0);
        if (!split && meshio__line_end(start, r->p) < r->p) split = start;
        if (result == MESHIO_OK)
            result = meshio__add_polygon(r, r->polygon.data, r->polygon.num, 0);
        if (!one_line) meshio__next_line(r);
    }
    if (result == MESHIO_OK) return meshio__no_more_faces(r, count);
    if (result == MESHIO_ERROR_TRUNCATED && split && split != start)
        return meshio__fail(r, result, split,
                            "the line ends before the face does, and the file before the last one");
    return result;
}

static meshio_result meshio__read_off(meshio__reader *r)
{
    size_t length, i;
    const unsigned char *word, *counts, *odd = NULL;
    meshio_result result;
    int64_t nv, nf;
    int extra = 0, one_line, is_off = 0;
    r->text = 1;
    r->comment = '#';
    word = meshio__word(r, &length);
    for (i = 0; i < length; i++) { /* [ST][C][N]OFF: each letter adds numbers to each vertex */
        int c = meshio__lower(word[i]);
        is_off = length - i >= 3 && meshio__same(word + i, 3, "off") &&
                 (length - i == 3 || meshio__is_digit(word[i + 3]));
        if (is_off) break;
        if (c == 'c')
            extra += 4;
        else if (c == 'n' && !(word[i] == 'n' && word[i + 1] == 'O')) /* nOFF: n-dimensional */
            extra += 3;
        else if (!(c == 's' && i == 0) && !(c == 't' && i == 1))
            break;
        if (c == 't') extra += 2;
    }
    if (is_off) {
        r->p = word + i + 3; /* some files have no blank before the counts */
    } else {                 /* the header may be left out */
        r->p = word;
        if (r->p == r->end) return meshio__expected(r, "the OFF header");
        if (length > 3 && meshio__same(word + length - 3, 3, "off") &&
            (word[length - 4] == '4' || word[length - 4] == 'n'))
            return meshio__fail(r, MESHIO_ERROR_UNSUPPORTED, word,
                                "only OFF files with points of three coordinates are read");
        if (!meshio__is_digit(*word))
            return meshio__fail(r, MESHIO_ERROR_FORMAT, word, "no OFF header");
    }
    meshio__skip(r);
    if (r->end - r->p >= 6 && meshio__same(r->p, 6, "binary"))
        return meshio__fail(r, MESHIO_ERROR_UNSUPPORTED, r->p, "binary OFF is not supported");
    MESHIO__TRY(meshio__int(r, &nv));
    MESHIO__TRY(meshio__int(r, &nf));
    MESHIO__TRY(meshio__off_edges(r));
    counts = r->p;
    meshio__skip(r);
    one_line = r->p < r->end && meshio__line_end(counts, r->p) == r->p;
    MESHIO__TRY(meshio__fits(r, nv, 6, "vertices"));
    MESHIO__TRY(meshio__fits(r, nf, 2, "faces"));
    r->p = counts;
    if (!one_line && meshio__off_has_lines(r, nv, nf, &odd)) extra = -1;
    result = meshio__off_vertices(r, nv, extra);
    if (result == MESHIO_OK && odd && meshio__more_on_line(r))
        result = MESHIO_ERROR_SYNTAX; /* the vertices do not end with a line, so the line is odd */
    if (result == MESHIO_OK) result = meshio__off_faces(r, nf, one_line);
    if (odd && result != MESHIO_OK && result != MESHIO_ERROR_OUT_OF_MEMORY)
        return meshio__fail(r, MESHIO_ERROR_SYNTAX, odd, "a vertex needs 3 numbers");
    return result;
}

/* ---- >>obj ---------------------------------------------------------------------------------- */

/* One corner of a face: v, v/t, v//n or v/t/n; only v is kept. It may refer to a vertex that comes
 * later in the file, so the caller compares it with the number of vertices at the end. */
static meshio_result meshio__obj_corner(meshio__reader *r, uint32_t *v)
{
    const unsigned char *start = r->p, *p = start;
    int64_t index = 0;
    int negative = *p == '-';
    if (negative) p++;
    if (!meshio__is_digit(*p)) return meshio__expected(r, "a vertex number");
    for (; meshio__is_digit(*p); p++)
        if (index < INT64_C(1) << 40) index = 10 * index + (*p - '0');
    while (*p == '/' || *p == '-' || meshio__is_digit(*p)) p++;
    if (!meshio__is_end(*p) && *p != '\\') return meshio__expected(r, "a vertex number");
    if (negative) index = (int64_t)r->mesh->num_vertices + 1 - index;
    if (index < 1 || index > (int64_t)MESHIO__MAX_COUNT)
        return meshio__fail(r, MESHIO_ERROR_INDEX, start, "vertex %.*s does not exist",
                            (int)(p - start), (const char *)start);
    *v = (uint32_t)(index - 1);
    r->p = p;
    return MESHIO_OK;
}

static meshio_result meshio__obj_face(meshio__reader *r, int64_t tag, const unsigned char **late,
                                      uint32_t *late_vertex)
{
    const unsigned char *start = r->p;
    r->polygon.num = 0;
    while (meshio__more_on_line(r)) {
        uint32_t v = 0;
        const unsigned char *where = r->p;
        MESHIO__TRY(meshio__obj_corner(r, &v));
        if (v >= r->mesh->num_vertices && (!*late || v > *late_vertex)) {
            *late = where;
            *late_vertex = v;
        }
        if (!meshio__push32(&r->polygon, v)) return meshio__no_memory(r);
    }
    if (r->polygon.num == 0) return meshio__fail(r, MESHIO_ERROR_SYNTAX, start, "an empty face");
    return meshio__add_polygon(r, r->polygon.data, r->polygon.num, tag);
}

static meshio_result meshio__read_obj(meshio__reader *r)
{
    int64_t group = 0;
    size_t group_start = 0, i, length;
    const unsigned char *late = NULL;
    uint32_t late_vertex = 0;
    r->text = 1;
    r->comment = '#';
    for (; r->p < r->end; meshio__next_line(r)) {
        const unsigned char *word;
        double xyz[3];
        if (!meshio__more_on_line(r)) continue;
        word = r->p;
        while (!meshio__is_end(*r->p)) r->p++;
        length = (size_t)(r->p - word);
        if (length == 0)
            return meshio__fail(r, MESHIO_ERROR_FORMAT, word, "a byte that no OBJ file has");
        if (length == 1 && word[0] == 'v') {
            for (i = 0; i < 3; i++) {
                if (!meshio__more_on_line(r))
                    return meshio__fail(r, MESHIO_ERROR_SYNTAX, word, "a vertex needs 3 numbers");
                MESHIO__TRY(meshio__double(r, &xyz[i]));
            }
            MESHIO__TRY(meshio__add_vertex(r, xyz, 0));
        } else if (length == 1 && word[0] == 'f') {
            MESHIO__TRY(meshio__obj_face(r, group, &late, &late_vertex));
        } else if (length == 1 && (word[0] == 'g' || word[0] == 'o')) {
            if (word[0] == 'o' && !r->mesh->name[0]) meshio__take_name(r);
            if (group == 0 || r->mesh->num_triangles > group_start) group++;
            group_start = r->mesh->num_triangles;
        } else if (length == 1 && (word[0] == 'l' || word[0] == 'p')) {
            r->mesh->num_other++;
        }
    }
    if (late && late_vertex >= r->mesh->num_vertices)
        return meshio__fail(r, MESHIO_ERROR_INDEX, late, "vertex %llu is used, but there are %llu",
                            (unsigned long long)late_vertex + 1,
                            (unsigned long long)r->mesh->num_vertices);
    if (r->mesh->num_vertices == 0)
        return meshio__fail(r, MESHIO_ERROR_FORMAT, r->begin, "no vertex in an OBJ file");
    if (group <= 1 && r->mesh->num_triangles > 0 &&
        r->mesh->triangle_tags[0] == r->mesh->triangle_tags[r->mesh->num_triangles - 1])
        for (i = 0; i < r->mesh->num_triangles; i++) r->mesh->triangle_tags[i] = 0;
    return MESHIO_OK;
}

/* ---- >>ply ---------------------------------------------------------------------------------- */

typedef struct meshio__ply_property {
    meshio__type type, count_type; /* count_type: NO_TYPE for a scalar */
    int role; /* 0 1 2: x y z; 3: the corners of a face; 4: those of strips; -1: skipped */
} meshio__ply_property;

typedef struct meshio__ply_element {
    int64_t count;
    int kind; /* 0: vertex, 1: face, 2: strips of triangles, 3: edge, -1: other */
    int num_properties;
    size_t first, bytes;
    const unsigned char *where;
} meshio__ply_element;

enum { MESHIO__PLY_ELEMENTS = 16, MESHIO__PLY_PROPERTIES = 256 };

typedef struct meshio__ply {
    int binary, num_elements, num_properties;
    size_t num_vertices; /* as the header claims: faces may come before the vertices */
    meshio__ply_element elements[MESHIO__PLY_ELEMENTS];
    meshio__ply_property properties[MESHIO__PLY_PROPERTIES];
} meshio__ply;

static meshio_result meshio__ply_property_line(meshio__reader *r, meshio__ply *ply)
{
    static const char *const coordinates[] = {"x", "y", "z"};
    meshio__ply_element *element;
    meshio__ply_property *property;
    const unsigned char *word;
    size_t length;
    int k;
    if (ply->num_elements == 0)
        return meshio__fail(r, MESHIO_ERROR_SYNTAX, r->p, "a property before any element");
    if (ply->num_properties == MESHIO__PLY_PROPERTIES)
        return meshio__fail(r, MESHIO_ERROR_UNSUPPORTED, r->p, "more than 256 properties");
    element = &ply->elements[ply->num_elements - 1];
    property = &ply->properties[ply->num_properties++];
    element->num_properties++;
    property->role = -1;
    property->count_type = MESHIO__NO_TYPE;
    word = meshio__word(r, &length);
    if (meshio__same(word, length, "list")) {
        word = meshio__word(r, &length);
        property->count_type = meshio__type_named(word, length);
        if (property->count_type >= MESHIO__F32)
            return meshio__fail(r, MESHIO_ERROR_SYNTAX, word, "a list's length must be an integer");
        word = meshio__word(r, &length);
    }
    property->type = meshio__type_named(word, length);
    if (property->type == MESHIO__NO_TYPE)
        return meshio__fail(r, MESHIO_ERROR_SYNTAX, word, "unknown type of a property");
    word = meshio__word(r, &length);
    if (property->count_type == MESHIO__NO_TYPE) {
        for (k = 0; k < 3; k++)
            if (element->kind == 0 && meshio__same(word, length, coordinates[k]))
                property->role = k;
    } else if ((element->kind == 1 || element->kind == 2) &&
               (meshio__same(word, length, "vertex_indices") ||
                meshio__same(word, length, "vertex_index"))) {
        if (property->type >= MESHIO__F32)
            return meshio__fail(r, MESHIO_ERROR_SYNTAX, word, "vertex numbers must be integers");
        property->role = element->kind + 2;
    }
    if (!ply->binary)
        element->bytes += 2;
    else
        element->bytes += meshio__type_size(
            property->count_type == MESHIO__NO_TYPE ? property->type : property->count_type);
    return MESHIO_OK;
}

/* Goes on after the last line of the header. Where lines end with CR alone, a line feed after it is
 * data. */
static void meshio__ply_body(meshio__reader *r)
{
    const unsigned char *p = meshio__line_end(r->begin, r->end);
    if (p == r->end || *p == '\n' || p[1] == '\n') {
        meshio__next_line(r);
        return;
    }
    while (r->p < r->end && *r->p != '\r') r->p++;
    if (r->p < r->end) r->p++;
}

static meshio_result meshio__ply_header(meshio__reader *r, meshio__ply *ply)
{
    size_t length;
    MESHIO__TRY(meshio__expect(r, "ply"));
    MESHIO__TRY(meshio__expect(r, "format"));
    {
        const unsigned char *word = meshio__word(r, &length);
        if (meshio__same(word, length, "binary_little_endian"))
            ply->binary = 1, r->swap = !meshio__little_endian();
        else if (meshio__same(word, length, "binary_big_endian"))
            ply->binary = 1, r->swap = meshio__little_endian();
        else if (!meshio__same(word, length, "ascii"))
            return meshio__fail(r, MESHIO_ERROR_UNSUPPORTED, word, "unknown PLY format");
    }
    for (;;) {
        const unsigned char *word;
        meshio__next_line(r);
        word = meshio__word(r, &length);
        if (meshio__same(word, length, "end_header")) break;
        if (meshio__same(word, length, "comment") || meshio__same(word, length, "obj_info"))
            continue;
        if (meshio__same(word, length, "element")) {
            meshio__ply_element *e;
            if (ply->num_elements == MESHIO__PLY_ELEMENTS)
                return meshio__fail(r, MESHIO_ERROR_UNSUPPORTED, word, "more than 16 elements");
            e = &ply->elements[ply->num_elements++];
            memset(e, 0, sizeof *e);
            e->first = (size_t)ply->num_properties;
            e->where = word;
            word = meshio__word(r, &length);
            e->kind = meshio__same(word, length, "vertex")      ? 0
                      : meshio__same(word, length, "face")      ? 1
                      : meshio__same(word, length, "tristrips") ? 2
                      : meshio__same(word, length, "edge")      ? 3
                                                                : -1;
            MESHIO__TRY(meshio__int(r, &e->count));
            if (e->kind == 0 && e->count > 0) ply->num_vertices += (size_t)e->count;
        } else if (meshio__same(word, length, "property")) {
            MESHIO__TRY(meshio__ply_property_line(r, ply));
        } else {
            r->p = word;
            return meshio__expected(r, "'element', 'property' or 'end_header'");
        }
    }
    meshio__ply_body(r);
    return MESHIO_OK;
}

/* Reads one property of one record: a coordinate, a list of corners, or something to skip. */
static meshio_result meshio__ply_value(meshio__reader *r, const meshio__ply *ply,
                                       const meshio__ply_property *property, double xyz[3])
{
    double d;
    int64_t n, index, i;
    const unsigned char *where;
    if (property->count_type == MESHIO__NO_TYPE) {
        MESHIO__TRY(meshio__scalar(r, ply->binary, property->type, &d, &n));
        if (property->role >= 0) xyz[property->role] = d;
        return MESHIO_OK;
    }
    MESHIO__TRY(meshio__scalar(r, ply->binary, property->count_type, &d, &n));
    MESHIO__TRY(meshio__fits(r, n, ply->binary ? meshio__type_size(property->type) : 2,
                             "entries of a list"));
    for (i = 0; i < n; i++) {
        uint32_t v = 0;
        if (!ply->binary) meshio__skip(r);
        where = r->p;
        MESHIO__TRY(meshio__scalar(r, ply->binary, property->type, &d, &index));
        if (property->role < 3) continue;
        if (property->role == 4 && index == -1) { /* the next strip */
            MESHIO__TRY(meshio__add_strip(r, r->polygon.data, r->polygon.num, 0));
            r->polygon.num = 0;
            continue;
        }
        MESHIO__TRY(meshio__vertex_of(r, where, index, 0, ply->num_vertices, &v));
        if (!meshio__push32(&r->polygon, v)) return meshio__no_memory(r);
    }
    return MESHIO_OK;
}

/* Reads one record of an element and adds it to the mesh. */
static meshio_result meshio__ply_record(meshio__reader *r, const meshio__ply *ply,
                                        const meshio__ply_element *element)
{
    double xyz[3];
    int k;
    r->polygon.num = 0;
    for (k = 0; k < element->num_properties; k++)
        MESHIO__TRY(meshio__ply_value(r, ply, &ply->properties[element->first + (size_t)k], xyz));
    switch (element->kind) {
    case 0: return meshio__add_vertex(r, xyz, 0);
    case 1: return meshio__add_polygon(r, r->polygon.data, r->polygon.num, 0);
    case 2: return meshio__add_strip(r, r->polygon.data, r->polygon.num, 0);
    case 3: r->mesh->num_other++; break;
    default: break;
    }
    return MESHIO_OK;
}

/* Compares the values on the line with those of a record: 0: as many; -1: fewer; 1: more. */
static int meshio__ply_line(meshio__reader *r, const meshio__ply *ply,
                            const meshio__ply_element *element)
{
    int64_t n;
    int k;
    for (k = 0; k < element->num_properties; k++) {
        n = 1;
        if (!meshio__more_on_line(r)) return -1;
        if (ply->properties[element->first + (size_t)k].count_type != MESHIO__NO_TYPE)
            n = meshio__number(r);
        for (; n > 0; n--) {
            if (!meshio__more_on_line(r)) return -1;
            while (r->p < r->end && !meshio__is_space(*r->p)) r->p++;
        }
    }
    return meshio__more_on_line(r);
}

/* Fails if most of the records of an element, which begins at `from`, have a line each, but one
 * that begins before `place` has not, nor has its line two of them. */
static meshio_result meshio__ply_odd_line(meshio__reader *r, const meshio__ply *ply,
                                          const meshio__ply_element *element,
                                          const unsigned char *from, const unsigned char *place)
{
    static const char *const names[] = {"an element", "a vertex", "a face", "an element",
                                        "an edge"}; /* by kind, from -1 */
    const unsigned char *start = r->p, *odd = NULL;
    int64_t lines = 0, num_odd = 0;
    int more = 0;
    for (r->p = from; lines < element->count && meshio__skip(r); lines++) {
        const unsigned char *line = r->p;
        int k = meshio__ply_line(r, ply, element);
        if (k != 0 && num_odd++ == 0) {
            odd = line;
            more = k;
            if (more > 0 && meshio__ply_line(r, ply, element) >= 0) odd = place;
        }
        meshio__next_line(r);
    }
    r->p = start;
    if (!odd || odd >= place || 2 * num_odd >= lines) return MESHIO_OK;
    return meshio__fail(r, MESHIO_ERROR_SYNTAX, odd, "the line has %s values than %s",
                        more > 0 ? "more" : "fewer", names[element->kind + 1]);
}

/* Reads all records of an element. In text each of them should have a line; another layout is read,
 * too, where it is not the exception. */
static meshio_result meshio__ply_records(meshio__reader *r, const meshio__ply *ply,
                                         const meshio__ply_element *element)
{
    const unsigned char *first = r->p, *start = r->p;
    meshio_result result = MESHIO_OK;
    int lines = !ply->binary; /* every record so far has a line */
    int64_t i;
    for (i = 0; i < element->count && result == MESHIO_OK; i++) {
        if (lines) meshio__skip(r);
        start = r->p;
        result = meshio__ply_record(r, ply, element);
        if (!lines || result != MESHIO_OK) continue;
        lines = meshio__line_end(start, r->p) == r->p && !meshio__more_on_line(r);
        if (!lines) result = meshio__ply_odd_line(r, ply, element, first, r->p);
    }
    if (lines && (result == MESHIO_ERROR_SYNTAX || result == MESHIO_ERROR_INDEX)) {
        const unsigned char *line = r->begin + r->report->offset; /* on which it failed */
        while (line > first && line[-1] != '\n' && line[-1] != '\r') line--;
        MESHIO__TRY(meshio__ply_odd_line(r, ply, element, first, line));
    }
    return result;
}

/* Fails if one more face follows the last element's. Anything else may be there. */
static meshio_result meshio__ply_no_more_faces(meshio__reader *r, const meshio__ply *ply,
                                               const meshio__ply_element *element)
{
    const meshio_report report = *r->report;
    const unsigned char *where;
    meshio_result result = MESHIO_OK;
    double unused[3];
    int k;
    if (!ply->binary) meshio__skip(r);
    where = r->p;
    r->polygon.num = 0;
    for (k = 0; k < element->num_properties && result == MESHIO_OK; k++)
        result = meshio__ply_value(r, ply, &ply->properties[element->first + (size_t)k], unused);
    if (result == MESHIO_ERROR_OUT_OF_MEMORY) return result;
    *r->report = report;
    if (result != MESHIO_OK || r->polygon.num < 3) return MESHIO_OK;
    return meshio__fail(r, MESHIO_ERROR_COUNT, where, "one more face than the %lld claimed",
                        (long long)element->count);
}

static meshio_result meshio__read_ply(meshio__reader *r)
{
    meshio__ply ply;
    int e, k, roles;
    memset(&ply, 0, sizeof ply);
    r->text = 1;
    MESHIO__TRY(meshio__ply_header(r, &ply));
    for (e = 0; e < ply.num_elements; e++) {
        const meshio__ply_element *element = &ply.elements[e];
        const meshio__ply_property *properties = ply.properties + element->first;
        for (roles = 0, k = 0; k < element->num_properties; k++)
            if (properties[k].role >= 0) roles |= 1 << properties[k].role;
        if (element->kind == 0 && roles != 7)
            return meshio__fail(r, MESHIO_ERROR_SYNTAX, element->where, "vertices without x, y, z");
        if ((element->kind == 1 || element->kind == 2) && element->count > 0 &&
            roles != 4 << element->kind)
            return meshio__fail(r, MESHIO_ERROR_UNSUPPORTED, element->where,
                                "faces without a list of vertex_indices");
        r->text = !ply.binary;
        MESHIO__TRY(meshio__fits(r, element->count, element->bytes, "elements"));
        if (element->num_properties) MESHIO__TRY(meshio__ply_records(r, &ply, element));
    }
    if (ply.num_elements == 0 || ply.elements[ply.num_elements - 1].kind != 1) return MESHIO_OK;
    return meshio__ply_no_more_faces(r, &ply, &ply.elements[ply.num_elements - 1]);
}

/* ---- >>medit -------------------------------------------------------------------------------- */

/* A keyword with entries. Keywords that are not in the table below are skipped. */
typedef struct meshio__medit_keyword {
    const char *name;
    /* code: in binary files; kind: the code of the same elements of first order; integers, nodes,
     * reals: the corners, other nodes and real numbers of an entry, which come before its tag */
    int code, kind, integers, nodes, reals;
} meshio__medit_keyword;

enum {
    MESHIO__MEDIT_DIMENSION = 3,
    MESHIO__MEDIT_VERTICES = 4,
    MESHIO__MEDIT_EDGES = 5,
    MESHIO__MEDIT_TRIANGLES = 6,
    MESHIO__MEDIT_QUADS = 7,
    MESHIO__MEDIT_TETS = 8,
    MESHIO__MEDIT_PRISMS = 9,
    MESHIO__MEDIT_HEXES = 10,
    MESHIO__MEDIT_PYRAMIDS = 49,
    MESHIO__MEDIT_END = 54
};

static const meshio__medit_keyword *meshio__medit_find(const unsigned char *name, size_t length,
                                                       int64_t code)
{
    static const meshio__medit_keyword keywords[] = {
        {"vertices", MESHIO__MEDIT_VERTICES, MESHIO__MEDIT_VERTICES, 0, 0, 3},
        {"edges", MESHIO__MEDIT_EDGES, MESHIO__MEDIT_EDGES, 2, 0, 0},
        {"triangles", MESHIO__MEDIT_TRIANGLES, MESHIO__MEDIT_TRIANGLES, 3, 0, 0},
        {"quadrilaterals", MESHIO__MEDIT_QUADS, MESHIO__MEDIT_QUADS, 4, 0, 0},
        {"tetrahedra", MESHIO__MEDIT_TETS, MESHIO__MEDIT_TETS, 4, 0, 0},
        {"prisms", MESHIO__MEDIT_PRISMS, MESHIO__MEDIT_PRISMS, 6, 0, 0},
        {"hexahedra", MESHIO__MEDIT_HEXES, MESHIO__MEDIT_HEXES, 8, 0, 0},
        {"pyramids", MESHIO__MEDIT_PYRAMIDS, MESHIO__MEDIT_PYRAMIDS, 5, 0, 0},
        {"edgesp2", 25, MESHIO__MEDIT_EDGES, 2, 1, 0},
        {"trianglesp2", 24, MESHIO__MEDIT_TRIANGLES, 3, 3, 0},
        {"quadrilateralsq2", 27, MESHIO__MEDIT_QUADS, 4, 5, 0},
        {"tetrahedrap2", 30, MESHIO__MEDIT_TETS, 4, 6, 0},
        {"prismsp2", 86, MESHIO__MEDIT_PRISMS, 6, 12, 0},
        {"hexahedraq2", 33, MESHIO__MEDIT_HEXES, 8, 19, 0},
        {"pyramidsp2", 87, MESHIO__MEDIT_PYRAMIDS, 5, 9, 0}};
    size_t i;
    for (i = 0; i < sizeof keywords / sizeof keywords[0]; i++)
        if (name ? meshio__same(name, length, keywords[i].name) : keywords[i].code == code)
            return &keywords[i];
    return NULL;
}

static meshio_result meshio__medit_store(meshio__reader *r, int kind, const uint32_t *v,
                                         int64_t tag)
{
    switch (kind) {
    case MESHIO__MEDIT_EDGES: return meshio__add_edge(r, v, tag);
    case MESHIO__MEDIT_TRIANGLES: return meshio__add_triangle(r, v[0], v[1], v[2], tag);
    case MESHIO__MEDIT_QUADS: return meshio__add_polygon(r, v, 4, tag);
    case MESHIO__MEDIT_TETS: return meshio__add_tet(r, v, tag);
    default: return meshio__add_solid(r);
    }
}

/* Counts the numbers before the next keyword, at most up to `most`; leaves the cursor. */
static int64_t meshio__medit_numbers(meshio__reader *r, int64_t most)
{
    const unsigned char *start = r->p;
    int64_t numbers = 0;
    while (numbers < most && meshio__skip(r) && !meshio__is_end(*r->p) &&
           !(meshio__lower(*r->p) >= 'a' && meshio__lower(*r->p) <= 'z')) {
        numbers++;
        while (!meshio__is_end(*r->p)) r->p++;
    }
    r->p = start;
    return numbers;
}

/* The nodes of an entry beside its corners. In text, Gmsh writes elements of second order under the
 * keywords of first order: then the first entry's line has that many numbers more. As entries may
 * stand on lines in any way, this counts only if the section's numbers are not just as many as
 * entries of first order have. */
static int meshio__medit_nodes(meshio__reader *r, const meshio__medit_keyword *keyword,
                               int64_t count)
{
    static const unsigned char more[9] = {0, 0, 0, 0, 0, 1, 3, 5, 6}; /* by code */
    const unsigned char *start = r->p;
    int nodes = keyword->code < 9 ? more[keyword->code] : 0, numbers = 0;
    if (nodes == 0 || !meshio__skip(r)) return keyword->nodes;
    for (; meshio__more_on_line(r) && !meshio__is_end(*r->p); numbers++)
        while (!meshio__is_end(*r->p)) r->p++;
    r->p = start;
    if (numbers != keyword->integers + nodes + 1) return keyword->nodes;
    count *= keyword->integers + 1;
    return meshio__medit_numbers(r, count + 1) == count ? keyword->nodes : nodes;
}

/* The entries of one keyword; `version` is 0 for text. */
static meshio_result meshio__medit_entries(meshio__reader *r, const meshio__medit_keyword *keyword,
                                           int64_t count, int version)
{
    double xyz[3], d;
    int64_t n, tag, index;
    uint32_t v[8], other = 0;
    int k, nodes = version ? keyword->nodes : meshio__medit_nodes(r, keyword, count);
    meshio__type integer = version >= 4 ? MESHIO__I64 : MESHIO__I32;
    meshio__type real = version == 1 ? MESHIO__F32 : MESHIO__F64;
    for (n = 0; n < count; n++) {
        for (k = 0; k < keyword->reals; k++)
            MESHIO__TRY(meshio__scalar(r, version, real, &xyz[k], &index));
        for (k = 0; k < keyword->integers + nodes; k++) {
            const unsigned char *where;
            if (!version) meshio__skip(r);
            where = r->p;
            MESHIO__TRY(meshio__scalar(r, version, integer, &d, &index));
            MESHIO__TRY(meshio__vertex(r, where, index, 1, k < keyword->integers ? &v[k] : &other));
            if (k >= keyword->integers && keyword->kind <= MESHIO__MEDIT_TETS)
                MESHIO__TRY(meshio__add_spare(r, &other, 1));
        }
        if (version)
            MESHIO__TRY(meshio__scalar(r, version, integer, &d, &tag));
        else
            MESHIO__TRY(meshio__int_or_double(r, &tag));
        if (keyword->reals)
            MESHIO__TRY(meshio__add_vertex(r, xyz, tag));
        else
            MESHIO__TRY(meshio__medit_store(r, keyword->kind, v, tag));
    }
    return MESHIO_OK;
}

static meshio_result meshio__read_medit(meshio__reader *r)
{
    int64_t version, dimension = 0, count;
    size_t length;
    r->text = 1;
    r->comment = '#';
    meshio__skip(r);
    if (r->end - r->p < 20 || !meshio__same(r->p, 20, "meshversionformatted"))
        return r->p < r->end ? meshio__fail(r, MESHIO_ERROR_FORMAT, r->p, "no MeshVersionFormatted")
                             : meshio__expected(r, "MeshVersionFormatted");
    r->p += 20;
    MESHIO__TRY(meshio__int(r, &version));
    for (;;) {
        const unsigned char *word = meshio__word(r, &length);
        const meshio__medit_keyword *keyword = meshio__medit_find(word, length, 0);
        if (length == 0 || meshio__same(word, length, "end")) break;
        if (keyword) {
            if (dimension != 3)
                return meshio__fail(r, MESHIO_ERROR_SYNTAX, word, "Dimension 3 must come first");
            MESHIO__TRY(meshio__int(r, &count));
            MESHIO__TRY(meshio__fits(r, count,
                                     2 * (size_t)(keyword->integers + keyword->nodes +
                                                  keyword->reals + 1),
                                     keyword->name));
            MESHIO__TRY(meshio__medit_entries(r, keyword, count, 0));
        } else if (meshio__same(word, length, "dimension")) {
            MESHIO__TRY(meshio__int(r, &dimension));
            if (dimension != 3)
                return meshio__fail(r, MESHIO_ERROR_UNSUPPORTED, word, "only Dimension 3 is read");
        } else if ((word[0] >= 'A' && word[0] <= 'Z') || (word[0] >= 'a' && word[0] <= 'z')) {
            double unused; /* another keyword: skip the numbers that follow it */
            while (meshio__skip(r) &&
                   (meshio__is_digit(*r->p) || *r->p == '-' || *r->p == '+' || *r->p == '.'))
                MESHIO__TRY(meshio__double(r, &unused));
        } else {
            r->p = word;
            return meshio__expected(r, "a keyword");
        }
    }
    return MESHIO_OK;
}

static meshio_result meshio__read_medit_binary(meshio__reader *r)
{
    int64_t magic, version, dimension = 0;
    size_t size = (size_t)(r->end - r->begin);
    if (size == 0) return meshio__expected(r, "the file's first four bytes");
    MESHIO__TRY(meshio__i32(r, &magic));
    if (magic != 1 && magic != 16777216)
        return meshio__fail(r, MESHIO_ERROR_FORMAT, r->begin, "not a binary Medit file");
    r->swap = magic != 1;
    MESHIO__TRY(meshio__i32(r, &version));
    if (version < 1 || version > 4)
        return meshio__fail(r, MESHIO_ERROR_UNSUPPORTED, r->begin + 4, "version %lld of 1 .. 4",
                            (long long)version);
    while (r->p < r->end) {
        const unsigned char *where = r->p;
        const meshio__medit_keyword *keyword;
        int64_t code, next = 0, count = 0;
        MESHIO__TRY(meshio__i32(r, &code));
        if (code == MESHIO__MEDIT_END) return MESHIO_OK;
        MESHIO__TRY(version >= 3 ? meshio__i64(r, &next) : meshio__i32(r, &next));
        if (version < 3) next &= 0xFFFFFFFF;
        if (next != 0 && (next <= (int64_t)(r->p - r->begin) || (uint64_t)next > (uint64_t)size))
            return meshio__fail(r, MESHIO_ERROR_COUNT, where,
                                "the next keyword is said to be at byte %lld, outside the file "
                                "or before this one",
                                (long long)next);
        keyword = meshio__medit_find(NULL, 0, code);
        if (code == MESHIO__MEDIT_DIMENSION) {
            MESHIO__TRY(meshio__i32(r, &dimension));
            if (dimension != 3)
                return meshio__fail(r, MESHIO_ERROR_UNSUPPORTED, where, "only dimension 3 is read");
        } else if (keyword) {
            size_t integers = (size_t)(keyword->integers + keyword->nodes + 1);
            size_t bytes = integers * (version >= 4 ? 8 : 4) +
                           (size_t)keyword->reals * (version == 1 ? 4 : 8);
            if (dimension != 3)
                return meshio__fail(r, MESHIO_ERROR_SYNTAX, where, "no dimension before %s",
                                    keyword->name);
            MESHIO__TRY(version >= 4 ? meshio__i64(r, &count) : meshio__i32(r, &count));
            MESHIO__TRY(meshio__fits(r, count, bytes, keyword->name));
            if (next && (uint64_t)count * bytes != (uint64_t)next - (uint64_t)(r->p - r->begin))
                return meshio__fail(r, MESHIO_ERROR_COUNT, where,
                                    "%lld %s do not fill the bytes up to the next keyword",
                                    (long long)count, keyword->name);
            MESHIO__TRY(meshio__medit_entries(r, keyword, count, (int)version));
        } else if (next == 0) {
            return meshio__fail(r, MESHIO_ERROR_SYNTAX, where, "keyword %lld has no successor",
                                (long long)code);
        }
        if (next) r->p = r->begin + next;
    }
    return MESHIO_OK;
}

/* ---- >>msh ---------------------------------------------------------------------------------- */

typedef struct meshio__msh {
    int version;        /* 10: version 1; 20: any 2.x; 40; 41 */
    int binary, narrow; /* narrow: sizes have 32 bits, not 64 */
    int have_nodes;
    int64_t type, physical, entity; /* of the last element of versions 1 and 2 */
    int turned; /* version 4: the physical tag of the current entity is negative: its elements have
                 * the opposite orientation in the physical group */
    uint32_t corners[8];            /* of the last element, sorted */
} meshio__msh;

/* Number of nodes of Gmsh's element types 1 .. 31, 92 and 93; 0: unknown. */
static int meshio__msh_nodes(int64_t type)
{
    static const unsigned char nodes[] = {0,  2,  3,  4,  4,  8,  6,  5,  3,  6,  9,
                                          10, 27, 18, 14, 1,  8,  20, 15, 13, 9,  10,
                                          12, 15, 15, 21, 4,  5,  6,  20, 35, 56};
    if (type >= 1 && type <= 31) return nodes[type];
    return type == 92 ? 64 : type == 93 ? 125 : 0;
}

static meshio_result meshio__msh_store(meshio__reader *r, int64_t type, const uint32_t *v,
                                       int64_t tag)
{
    switch (type) {
    case 1: case 8: case 26: case 27: case 28: return meshio__add_edge(r, v, tag);
    case 2: case 9: case 20: case 21: case 22: case 23: case 24: case 25:
        return meshio__add_triangle(r, v[0], v[1], v[2], tag);
    case 3: case 10: case 16: return meshio__add_polygon(r, v, 4, tag);
    case 4: case 11: case 29: case 30: case 31: return meshio__add_tet(r, v, tag);
    case 15: return MESHIO_OK; /* a point: its vertex is there already */
    default: return meshio__add_solid(r);
    }
}

/* The number of corners of the types of higher order that are kept by their corners; of other types
 * the number of nodes. */
static int meshio__msh_corners(int64_t type)
{
    switch (type) {
    case 8: case 26: case 27: case 28: return 2;
    case 9: case 20: case 21: case 22: case 23: case 24: case 25: return 3;
    case 10: case 16: case 11: case 29: case 30: case 31: return 4;
    default: return meshio__msh_nodes(type);
    }
}

/* An integer: decimal in text; in binary 64 bits if `wide`, unless the file has sizes of 32 bits;
 * else 32 bits. */
static meshio_result meshio__msh_int(meshio__reader *r, const meshio__msh *msh, int wide,
                                     int64_t *value)
{
    if (!msh->binary) return meshio__int(r, value);
    return wide && !msh->narrow ? meshio__i64(r, value) : meshio__i32(r, value);
}

static meshio_result meshio__msh_real(meshio__reader *r, const meshio__msh *msh, double *value)
{
    return msh->binary ? meshio__f64(r, value) : meshio__double(r, value);
}

static int meshio__compare_ids(const void *pa, const void *pb)
{
    const uint64_t *a = (const uint64_t *)pa, *b = (const uint64_t *)pb;
    if (a[0] != b[0]) return a[0] < b[0] ? -1 : 1;
    return a[1] < b[1] ? -1 : a[1] > b[1];
}

/* Records the file's id of the vertex that is about to be added. Pairs are stored only from the
 * first id on that does not continue the sequence. */
static meshio_result meshio__id_add(meshio__reader *r, int64_t id, size_t vertex)
{
    size_t i;
    if (id < 0) return meshio__fail(r, MESHIO_ERROR_INDEX, r->p, "negative node number");
    if (vertex == 0) r->first_id = (uint64_t)id, r->ids_consecutive = 1;
    if (r->ids_consecutive && (uint64_t)id == r->first_id + vertex) return MESHIO_OK;
    if (r->ids_consecutive) {
        r->ids_consecutive = 0;
        for (i = 0; i < vertex; i++)
            if (!meshio__push64(&r->ids, r->first_id + i) || !meshio__push64(&r->ids, i))
                return meshio__no_memory(r);
    }
    if (!meshio__push64(&r->ids, (uint64_t)id) || !meshio__push64(&r->ids, vertex))
        return meshio__no_memory(r);
    return MESHIO_OK;
}

/* The number of a node in the file, for messages. */
static unsigned long long meshio__shown_id(const meshio__reader *r, uint64_t id)
{
    return r->id_bits ? id & ((UINT64_C(1) << r->id_bits) - 1) : id;
}

/* After the last id: sorts the pairs; fails if an id occurs twice. */
static meshio_result meshio__ids_close(meshio__reader *r)
{
    size_t i;
    if (r->ids_consecutive || r->ids.num == 0) return MESHIO_OK;
    qsort(r->ids.data, r->ids.num / 2, 2 * sizeof(uint64_t), meshio__compare_ids);
    for (i = 2; i < r->ids.num; i += 2)
        if (r->ids.data[i] == r->ids.data[i - 2])
            return meshio__fail(r, MESHIO_ERROR_INDEX, r->p,
                                "node %llu is defined twice, before this place",
                                meshio__shown_id(r, r->ids.data[i]));
    return MESHIO_OK;
}

/* Sorted records of `width` numbers: the index of the first whose first number is not below key. */
static size_t meshio__records_from(const meshio__u64s *records, size_t width, uint64_t key)
{
    size_t lo = 0, hi = records->num / width;
    while (lo < hi) {
        size_t mid = lo + (hi - lo) / 2;
        if (records->data[width * mid] < key)
            lo = mid + 1;
        else
            hi = mid;
    }
    return lo;
}

/* Sorted pairs (key, value): the index of the pair with this key, or the number of pairs. */
static size_t meshio__pair_find(const meshio__u64s *pairs, uint64_t key)
{
    size_t k = meshio__records_from(pairs, 2, key), n = pairs->num / 2;
    return k < n && pairs->data[2 * k] == key ? k : n;
}

static meshio_result meshio__id_find(meshio__reader *r, const unsigned char *where, int64_t id,
                                     uint32_t *vertex)
{
    size_t k, n = r->mesh->num_vertices;
    if (id >= 0 && r->ids_consecutive && (uint64_t)id >= r->first_id &&
        (uint64_t)id - r->first_id < n) {
        *vertex = (uint32_t)((uint64_t)id - r->first_id);
        return MESHIO_OK;
    }
    if (id >= 0 && !r->ids_consecutive) {
        k = meshio__pair_find(&r->ids, (uint64_t)id);
        if (k < r->ids.num / 2) {
            *vertex = (uint32_t)r->ids.data[2 * k + 1];
            return MESHIO_OK;
        }
    }
    return meshio__fail(r, MESHIO_ERROR_INDEX, where, "node %s%llu is not defined",
                        id < 0 ? "-" : "",
                        meshio__shown_id(r, id < 0 ? 0 - (uint64_t)id : (uint64_t)id));
}

/* Nodes of versions 1 and 2. `parametric`: each node also has its entity and its parameters on it.
 * In version 1 what else is on the line is skipped. */
static meshio_result meshio__msh_nodes2(meshio__reader *r, const meshio__msh *msh, int parametric)
{
    int64_t count, id, dimension, unused, i;
    double xyz[3], u;
    int k;
    MESHIO__TRY(meshio__int(r, &count));
    if (msh->binary) meshio__next_line(r);
    MESHIO__TRY(meshio__fits(r, count, msh->binary ? 28 : 8, "nodes"));
    for (i = 0; i < count; i++) {
        MESHIO__TRY(meshio__msh_int(r, msh, 0, &id));
        for (k = 0; k < 3; k++) MESHIO__TRY(meshio__msh_real(r, msh, &xyz[k]));
        if (parametric) {
            MESHIO__TRY(meshio__msh_int(r, msh, 0, &dimension));
            MESHIO__TRY(meshio__msh_int(r, msh, 0, &unused));
            for (k = 0; k < dimension && dimension < 3; k++)
                MESHIO__TRY(meshio__msh_real(r, msh, &u));
        }
        if (msh->version == 10) meshio__next_line(r);
        MESHIO__TRY(meshio__id_add(r, id, (size_t)i));
        MESHIO__TRY(meshio__add_vertex(r, xyz, 0));
    }
    return meshio__ids_close(r);
}

/* Nodes of versions 4.0, where each id comes before its node's coordinates, and 4.1, where all ids
 * of a block come before all its coordinates. */
static meshio_result meshio__msh_nodes4(meshio__reader *r, const meshio__msh *msh)
{
    int64_t blocks, count, unused, dimension, parametric, num, b, i, id;
    size_t done = 0;
    double xyz[3], u;
    int k, new41 = msh->version == 41;
    MESHIO__TRY(meshio__msh_int(r, msh, 1, &blocks));
    MESHIO__TRY(meshio__msh_int(r, msh, 1, &count));
    for (k = 0; new41 && k < 2; k++) MESHIO__TRY(meshio__msh_int(r, msh, 1, &unused));
    MESHIO__TRY(meshio__fits(r, count, msh->binary ? 28 : 8, "nodes"));
    MESHIO__TRY(meshio__fits(r, blocks, msh->binary ? 16 : 8, "blocks of nodes"));
    for (b = 0; b < blocks; b++) {
        MESHIO__TRY(meshio__msh_int(r, msh, 0, new41 ? &dimension : &unused));
        MESHIO__TRY(meshio__msh_int(r, msh, 0, new41 ? &unused : &dimension));
        MESHIO__TRY(meshio__msh_int(r, msh, 0, &parametric));
        MESHIO__TRY(meshio__msh_int(r, msh, 1, &num));
        MESHIO__TRY(meshio__fits(r, num, msh->binary ? 28 : 8, "nodes in a block"));
        if (dimension < 0 || dimension > 3)
            return meshio__fail(r, MESHIO_ERROR_SYNTAX, r->p, "an entity of dimension %lld",
                                (long long)dimension);
        if ((uint64_t)num > (uint64_t)count - done)
            return meshio__fail(r, MESHIO_ERROR_COUNT, r->p, "the blocks hold more than %lld nodes",
                                (long long)count);
        for (i = 0; new41 && i < num; i++) {
            MESHIO__TRY(meshio__msh_int(r, msh, 1, &id));
            MESHIO__TRY(meshio__id_add(r, id, done + (size_t)i));
        }
        for (i = 0; i < num; i++) {
            if (!new41) {
                MESHIO__TRY(meshio__msh_int(r, msh, 0, &id));
                MESHIO__TRY(meshio__id_add(r, id, done + (size_t)i));
            }
            for (k = 0; k < 3; k++) MESHIO__TRY(meshio__msh_real(r, msh, &xyz[k]));
            for (k = 0; parametric && k < dimension; k++) MESHIO__TRY(meshio__msh_real(r, msh, &u));
            MESHIO__TRY(meshio__add_vertex(r, xyz, 0));
        }
        done += (size_t)num;
    }
    if (done != (uint64_t)count)
        return meshio__fail(r, MESHIO_ERROR_COUNT, r->p, "%llu nodes where %lld were claimed",
                            (unsigned long long)done, (long long)count);
    return meshio__ids_close(r);
}

/* Versions 1 and 2 repeat an element immediately for each further physical group that it is in.
 * Returns whether this is such a repetition; if not, the element is remembered. */
static int meshio__msh_repeats(meshio__msh *msh, int64_t type, int64_t physical, int64_t entity,
                               const uint32_t *v, int n)
{
    uint32_t sorted[8] = {0, 0, 0, 0, 0, 0, 0, 0};
    int i, k, same = type == msh->type && physical != msh->physical && entity == msh->entity;
    for (i = 0; i < n; i++) {
        for (k = i; k > 0 && sorted[k - 1] > v[i]; k--) sorted[k] = sorted[k - 1];
        sorted[k] = v[i];
    }
    if (same && memcmp(sorted, msh->corners, sizeof sorted) == 0) return 1;
    msh->type = type;
    msh->physical = physical;
    msh->entity = entity;
    memcpy(msh->corners, sorted, sizeof sorted);
    return 0;
}

static meshio_result meshio__msh_unknown(meshio__reader *r, int64_t type)
{
    if (type > 31 && type <= 140)
        return meshio__fail(r, MESHIO_ERROR_UNSUPPORTED, r->p,
                            "elements of type %lld, of a high order, are not read",
                            (long long)type);
    return meshio__fail(r, MESHIO_ERROR_SYNTAX, r->p, "unknown type of element: %lld",
                        (long long)type);
}

/* Reverses the orientation of an edge, triangle or quadrangle, given by its corners. */
static void meshio__msh_turn(int64_t type, uint32_t *v)
{
    int edge = type == 1 || type == 8 || (type >= 26 && type <= 28),
        quadrangle = type == 3 || type == 10 || type == 16, a = edge ? 0 : 1,
        b = edge ? 1 : quadrangle ? 3 : 2;
    uint32_t other = v[a];
    v[a] = v[b];
    v[b] = other;
}

/* Reads the nodes of one element and adds it to the mesh; its tag is its physical group, or its
 * entity if it is in no group. */
static meshio_result meshio__msh_element(meshio__reader *r, meshio__msh *msh, int wide,
                                         int64_t type, int64_t physical, int64_t entity)
{
    uint32_t v[8], other = 0;
    int k, n = meshio__msh_nodes(type);
    int corners = type == 15 && physical == 0 ? 0 : meshio__msh_corners(type);
    int64_t id;
    for (k = 0; k < n; k++) {
        const unsigned char *where;
        if (!msh->binary) meshio__skip(r);
        where = r->p;
        MESHIO__TRY(meshio__msh_int(r, msh, wide, &id));
        MESHIO__TRY(meshio__id_find(r, where, id, &other));
        if (k < 8) v[k] = other;
        if (k >= corners) MESHIO__TRY(meshio__add_spare(r, &other, 1));
    }
    if (msh->version < 40 && meshio__msh_repeats(msh, type, physical, entity, v, n < 8 ? n : 8)) {
        r->mesh->num_regrouped++;
        return MESHIO_OK;
    }
    if (msh->turned) meshio__msh_turn(type, v);
    return meshio__msh_store(r, type, v, physical ? physical : entity);
}

/* Version 1: number, type, physical and elementary tag, number of nodes, nodes. */
static meshio_result meshio__msh_elements1(meshio__reader *r, meshio__msh *msh)
{
    int64_t count, id, type, physical, tag, nodes, i;
    MESHIO__TRY(meshio__int(r, &count));
    MESHIO__TRY(meshio__fits(r, count, 10, "elements"));
    for (i = 0; i < count; i++) {
        MESHIO__TRY(meshio__int(r, &id));
        MESHIO__TRY(meshio__int(r, &type));
        MESHIO__TRY(meshio__int(r, &physical));
        MESHIO__TRY(meshio__int(r, &tag));
        MESHIO__TRY(meshio__int(r, &nodes));
        if (nodes < 1 || meshio__msh_nodes(type) != nodes)
            return meshio__fail(r, MESHIO_ERROR_SYNTAX, r->p,
                                "element %lld of type %lld has %lld nodes", (long long)id,
                                (long long)type, (long long)nodes);
        MESHIO__TRY(meshio__msh_element(r, msh, 0, type, physical, tag));
    }
    return MESHIO_OK;
}

static meshio_result meshio__msh_elements2(meshio__reader *r, meshio__msh *msh)
{
    int64_t count, done = 0, type, follow = 1, num_tags, unused, tag, physical, i, k;
    MESHIO__TRY(meshio__int(r, &count));
    if (msh->binary) meshio__next_line(r);
    MESHIO__TRY(meshio__fits(r, count, 8, "elements"));
    while (done < count) {
        if (!msh->binary) MESHIO__TRY(meshio__int(r, &unused));
        MESHIO__TRY(meshio__msh_int(r, msh, 0, &type));
        if (msh->binary) MESHIO__TRY(meshio__i32(r, &follow));
        MESHIO__TRY(meshio__msh_int(r, msh, 0, &num_tags));
        if (meshio__msh_nodes(type) == 0)
            return meshio__msh_unknown(r, type);
        MESHIO__TRY(meshio__fits(r, num_tags, 2, "tags of an element"));
        if (follow < 1 || follow > count - done)
            return meshio__fail(r, MESHIO_ERROR_COUNT, r->p, "a block of %lld elements of %lld",
                                (long long)follow, (long long)(count - done));
        for (i = 0; i < follow; i++) {
            if (msh->binary) MESHIO__TRY(meshio__i32(r, &unused));
            for (tag = physical = 0, k = 0; k < num_tags; k++) {
                MESHIO__TRY(meshio__msh_int(r, msh, 0, &unused));
                if (k == 0) physical = unused;
                if (k == 1) tag = unused;
            }
            MESHIO__TRY(meshio__msh_element(r, msh, 0, type, physical, tag));
        }
        done += follow;
    }
    return MESHIO_OK;
}

/* Reads a count and that many integers; returns the first of them, or 0, and the count. */
static meshio_result meshio__msh_ints(meshio__reader *r, const meshio__msh *msh, const char *what,
                                      int64_t *first, int64_t *count)
{
    int64_t num, value, k;
    *first = 0;
    MESHIO__TRY(meshio__msh_int(r, msh, 1, &num));
    MESHIO__TRY(meshio__fits(r, num, 2, what));
    *count = num;
    for (k = 0; k < num; k++) {
        MESHIO__TRY(meshio__msh_int(r, msh, 0, &value));
        if (k == 0) *first = value;
    }
    return MESHIO_OK;
}

/* Reads one entity of dimension d. In a partitioned mesh it also has its parent and partitions. */
static meshio_result meshio__msh_entity(meshio__reader *r, const meshio__msh *msh, int d,
                                        int partitioned)
{
    int64_t tag, unused, physical, groups;
    double box;
    int k;
    MESHIO__TRY(meshio__msh_int(r, msh, 0, &tag));
    if (partitioned) {
        MESHIO__TRY(meshio__msh_int(r, msh, 0, &unused));
        MESHIO__TRY(meshio__msh_int(r, msh, 0, &unused));
        MESHIO__TRY(meshio__msh_ints(r, msh, "partitions", &unused, &groups));
    }
    for (k = 0; k < (d == 0 && msh->version == 41 ? 3 : 6); k++)
        MESHIO__TRY(meshio__msh_real(r, msh, &box));
    MESHIO__TRY(meshio__msh_ints(r, msh, "physical tags", &physical, &groups));
    if (d > 0) MESHIO__TRY(meshio__msh_ints(r, msh, "bounding entities", &unused, &unused));
    if (physical != 0 && (!meshio__push64(&r->entities, (uint64_t)d << 32 | (uint32_t)tag) ||
                          !meshio__push64(&r->entities, (uint64_t)physical)))
        return meshio__no_memory(r);
    if (groups > 1 && (!meshio__push64(&r->grouped, (uint64_t)d << 32 | (uint32_t)tag) ||
                       !meshio__push64(&r->grouped, (uint64_t)groups)))
        return meshio__no_memory(r);
    return MESHIO_OK;
}

/* Reads the entities, for their physical groups: r->entities gets pairs (dimension and tag of the
 * entity, first physical tag), r->grouped pairs (the same, number of groups); both are sorted. */
static meshio_result meshio__msh_entities(meshio__reader *r, const meshio__msh *msh,
                                          int partitioned)
{
    int64_t counts[4], ghosts, unused, i;
    int d;
    if (partitioned) {
        MESHIO__TRY(meshio__msh_int(r, msh, 1, &unused));
        MESHIO__TRY(meshio__msh_int(r, msh, 1, &ghosts));
        MESHIO__TRY(meshio__fits(r, ghosts, 4, "ghost entities"));
        for (i = 0; i < 2 * ghosts; i++) MESHIO__TRY(meshio__msh_int(r, msh, 0, &unused));
    }
    for (d = 0; d < 4; d++) {
        MESHIO__TRY(meshio__msh_int(r, msh, 1, &counts[d]));
        MESHIO__TRY(meshio__fits(r, counts[d], 8, "entities"));
    }
    for (d = 0; d < 4; d++)
        for (i = 0; i < counts[d]; i++) MESHIO__TRY(meshio__msh_entity(r, msh, d, partitioned));
    if (r->entities.num)
        qsort(r->entities.data, r->entities.num / 2, 2 * sizeof(uint64_t), meshio__compare_ids);
    if (r->grouped.num)
        qsort(r->grouped.data, r->grouped.num / 2, 2 * sizeof(uint64_t), meshio__compare_ids);
    return MESHIO_OK;
}

static meshio_result meshio__msh_elements4(meshio__reader *r, meshio__msh *msh)
{
    int64_t blocks, count, unused, dimension, tag, physical, type, num, b, i;
    uint64_t done = 0, key;
    size_t pair;
    int k, new41 = msh->version == 41;
    MESHIO__TRY(meshio__msh_int(r, msh, 1, &blocks));
    MESHIO__TRY(meshio__msh_int(r, msh, 1, &count));
    for (k = 0; new41 && k < 2; k++) MESHIO__TRY(meshio__msh_int(r, msh, 1, &unused));
    MESHIO__TRY(meshio__fits(r, count, msh->binary ? 8 : 4, "elements"));
    MESHIO__TRY(meshio__fits(r, blocks, msh->binary ? 16 : 8, "blocks of elements"));
    for (b = 0; b < blocks; b++) {
        MESHIO__TRY(meshio__msh_int(r, msh, 0, new41 ? &dimension : &tag));
        MESHIO__TRY(meshio__msh_int(r, msh, 0, new41 ? &tag : &dimension));
        MESHIO__TRY(meshio__msh_int(r, msh, 0, &type));
        MESHIO__TRY(meshio__msh_int(r, msh, 1, &num));
        if (meshio__msh_nodes(type) == 0)
            return meshio__msh_unknown(r, type);
        MESHIO__TRY(meshio__fits(r, num, msh->binary ? 8 : 4, "elements in a block"));
        key = (uint64_t)(dimension & 3) << 32 | (uint32_t)tag;
        pair = meshio__pair_find(&r->entities, key);
        physical = pair < r->entities.num / 2 ? (int64_t)r->entities.data[2 * pair + 1] : 0;
        pair = meshio__pair_find(&r->grouped, key);
        if (pair < r->grouped.num / 2)
            r->mesh->num_regrouped += (size_t)num * (size_t)(r->grouped.data[2 * pair + 1] - 1);
        msh->turned = physical < 0 && tag > 0 && (dimension == 1 || dimension == 2);
        if (msh->turned) physical = -physical;
        for (i = 0; i < num; i++) {
            MESHIO__TRY(meshio__msh_int(r, msh, new41, &unused));
            MESHIO__TRY(meshio__msh_element(r, msh, new41, type, physical, tag));
        }
        done += (uint64_t)num;
    }
    if (done != (uint64_t)count)
        return meshio__fail(r, MESHIO_ERROR_COUNT, r->p, "%llu elements where %lld were claimed",
                            (unsigned long long)done, (long long)count);
    return MESHIO_OK;
}

static meshio_result meshio__msh_header(meshio__reader *r, meshio__msh *msh)
{
    double version;
    int64_t kind, size, one = 0;
    const unsigned char *where;
    MESHIO__TRY(meshio__double(r, &version));
    where = r->p;
    MESHIO__TRY(meshio__int(r, &kind));
    MESHIO__TRY(meshio__int(r, &size));
    msh->version = version >= 2 && version < 3         ? 20
                   : version >= 4 && version <= 4.05   ? 40
                   : version > 4.05 && version < 4.15 ? 41
                                                       : 0;
    if (msh->version == 0)
        return meshio__fail(r, MESHIO_ERROR_UNSUPPORTED, where,
                            "MSH version %.3g; 1, 2.x, 4.0 and 4.1 are read", version);
    if (kind != 0 && kind != 1)
        return meshio__fail(r, MESHIO_ERROR_SYNTAX, where, "file-type %lld", (long long)kind);
    if (size != 8 && !(size == 4 && msh->version >= 40))
        return meshio__fail(r, MESHIO_ERROR_UNSUPPORTED, where, "data-size %lld, not 8",
                            (long long)size);
    msh->narrow = size == 4;
    msh->binary = kind == 1;
    if (msh->binary) {
        meshio__next_line(r);
        MESHIO__TRY(meshio__i32(r, &one));
        if (one != 1 && one != 16777216)
            return meshio__fail(r, MESHIO_ERROR_SYNTAX, r->p - 4, "no 1 after a binary header");
        r->swap = one != 1;
    }
    return MESHIO_OK;
}

/* Skips a section, up to the "$End..." that closes it. */
static meshio_result meshio__msh_skip(meshio__reader *r, const unsigned char *name, size_t length)
{
    const unsigned char *p = r->p;
    size_t rest = length - 1; /* the name without its '$' */
    while (p < r->end && (p = (const unsigned char *)memchr(p, '$', (size_t)(r->end - p)))) {
        if ((size_t)(r->end - p) >= rest + 4 && memcmp(p, "$End", 4) == 0 &&
            memcmp(p + 4, name + 1, rest) == 0) {
            r->p = p + 4 + rest;
            return MESHIO_OK;
        }
        p++;
    }
    return meshio__fail(r, MESHIO_ERROR_TRUNCATED, name, "this section does not end");
}

/* Keeps the name of a physical group, if the line has one: its dimension, its tag, and the name in
 * quotes. */
static meshio_result meshio__msh_name(meshio__reader *r, const char *line)
{
    meshio_mesh *m = r->mesh;
    void *data = m->names;
    meshio_name name;
    double tag; /* of at most 11 characters, so that no number overflows */
    memset(&name, 0, sizeof name);
    if (sscanf(line, "%2d %11lf \"%127[^\"]", &name.dimension, &tag, name.text) != 3 ||
        name.dimension < 0 || name.dimension > 3 || !(tag >= INT32_MIN && tag <= INT32_MAX))
        return MESHIO_OK;
    name.tag = (int32_t)tag;
    if (m->num_names == r->cap_names) {
        if (!meshio__reserve(&data, &r->cap_names, m->num_names + 1, sizeof name))
            return meshio__no_memory(r);
        m->names = (meshio_name *)data;
    }
    m->names[m->num_names++] = name;
    return MESHIO_OK;
}

/* Reads the names of physical groups, which are text in binary files, too. */
static meshio_result meshio__msh_names(meshio__reader *r)
{
    const unsigned char *p = r->p;
    while (p < r->end && *p != '$') {
        const unsigned char *end = meshio__line_end(p, r->end);
        size_t length = (size_t)(end - p);
        char line[256];
        if (length >= sizeof line) length = sizeof line - 1;
        memcpy(line, p, length);
        line[length] = 0;
        MESHIO__TRY(meshio__msh_name(r, line));
        p = end < r->end ? end + 1 : end;
    }
    return MESHIO_OK;
}

/* Reads a section whose name has been read. */
static meshio_result meshio__msh_section(meshio__reader *r, meshio__msh *msh,
                                         const unsigned char *name, size_t length)
{
    int parametric = meshio__same(name, length, "$parametricnodes");
    int partitioned = meshio__same(name, length, "$partitionedentities");
    const char *end;
    if (parametric || meshio__same(name, length, msh->version == 10 ? "$nod" : "$nodes")) {
        if (msh->have_nodes++)
            return meshio__fail(r, MESHIO_ERROR_SYNTAX, name, "a second section of nodes");
        MESHIO__TRY(msh->version >= 40 ? meshio__msh_nodes4(r, msh)
                                       : meshio__msh_nodes2(r, msh, parametric));
        end = parametric ? "$endparametricnodes" : msh->version == 10 ? "$endnod" : "$endnodes";
    } else if (meshio__same(name, length, msh->version == 10 ? "$elm" : "$elements")) {
        MESHIO__TRY(msh->version >= 40   ? meshio__msh_elements4(r, msh)
                    : msh->version == 10 ? meshio__msh_elements1(r, msh)
                                         : meshio__msh_elements2(r, msh));
        end = msh->version == 10 ? "$endelm" : "$endelements";
    } else if (msh->version >= 40 && (partitioned || meshio__same(name, length, "$entities"))) {
        MESHIO__TRY(meshio__msh_entities(r, msh, partitioned));
        end = partitioned ? "$endpartitionedentities" : "$endentities";
    } else {
        if (meshio__same(name, length, "$physicalnames")) MESHIO__TRY(meshio__msh_names(r));
        return meshio__msh_skip(r, name, length);
    }
    return meshio__expect(r, end);
}

static meshio_result meshio__read_msh(meshio__reader *r)
{
    meshio__msh msh;
    size_t length;
    const unsigned char *word;
    memset(&msh, 0, sizeof msh);
    r->text = 1;
    word = meshio__word(r, &length);
    while (meshio__same(word, length, "$comments")) {
        MESHIO__TRY(meshio__msh_skip(r, word, length));
        word = meshio__word(r, &length);
    }
    if (meshio__same(word, length, "$nod")) {
        msh.version = 10;
        r->p = word;
    } else if (meshio__same(word, length, "$meshformat")) {
        MESHIO__TRY(meshio__msh_header(r, &msh));
        MESHIO__TRY(meshio__expect(r, "$endmeshformat"));
    } else {
        r->p = word;
        if (r->p < r->end)
            return meshio__fail(r, MESHIO_ERROR_FORMAT, word, "no $MeshFormat, nor $NOD");
        return meshio__expected(r, "$MeshFormat");
    }
    while ((word = meshio__word(r, &length), length) != 0) {
        if (word[0] != '$' || length < 2) {
            r->p = word;
            return meshio__expected(r, "a section");
        }
        if (msh.binary) r->text = 0, meshio__next_line(r);
        MESHIO__TRY(meshio__msh_section(r, &msh, word, length));
    }
    if (!msh.have_nodes) return meshio__expected(r, "$Nodes");
    return MESHIO_OK;
}

/* ---- >>cells  what VTK and VTU files share -------------------------------------------------- */

/* Can a cell of this VTK type have n points? A Lagrange or Bezier cell, of any order, has at least
 * its corners, which come first. */
static int meshio__cell_has(uint32_t type, size_t n)
{
    static const unsigned char points[36] = {0, 0, 0, 2, 0, 3, 0, 0, 4, 4, 4, 0, 0, 0, 0, 0, 0, 0,
                                             0, 0, 0, 3, 6, 8, 10, 0, 0, 0, 9, 0, 6, 0, 0, 0, 7, 4};
    if (type < 36) return points[type] == 0 || points[type] == n;
    switch (type) {
    case 68: case 75: return n >= 2;
    case 69: case 76: return n >= 3;
    case 70: case 71: case 77: case 78: return n >= 4;
    default: return 1;
    }
}

/* The number of corners of the types of higher order that are kept by their corners; 0: another
 * type. */
static size_t meshio__cell_corners(uint32_t type)
{
    switch (type) {
    case 21: case 35: case 68: case 75: return 2;
    case 22: case 34: case 69: case 76: return 3;
    case 23: case 28: case 30: case 70: case 77: case 24: case 71: case 78: return 4;
    default: return 0;
    }
}

/* Turns the collected cells into edges, triangles and tetrahedra. */
static meshio_result meshio__cells_store(meshio__reader *r)
{
    const meshio__cells *cells = &r->cells;
    size_t c, start = 0, n, i, corners;
    if (cells->tags.num && cells->tags.num != cells->ends.num)
        return meshio__fail(r, MESHIO_ERROR_COUNT, r->p, "%llu tags for %llu cells",
                            (unsigned long long)cells->tags.num,
                            (unsigned long long)cells->ends.num);
    for (c = 0; c < cells->ends.num; c++) {
        const uint32_t *v = cells->corners.data + start;
        int64_t tag = cells->tags.num ? (int32_t)cells->tags.data[c] : 0;
        uint32_t type = cells->types.data[c];
        n = (size_t)cells->ends.data[c] - start;
        start = (size_t)cells->ends.data[c];
        if (!meshio__cell_has(type, n))
            return meshio__fail(r, MESHIO_ERROR_COUNT, r->p,
                                "cell %llu of type %lu has %llu corners", (unsigned long long)c,
                                (unsigned long)type, (unsigned long long)n);
        corners = meshio__cell_corners(type);
        if (corners && n > corners) MESHIO__TRY(meshio__add_spare(r, v + corners, n - corners));
        switch (type) {
        case 3: case 21: case 35: case 68: case 75:
            MESHIO__TRY(meshio__add_edge(r, v, tag));
            break;
        case 4:
            for (i = 1; i < n; i++) MESHIO__TRY(meshio__add_edge(r, v + i - 1, tag));
            break;
        case 5: case 22: case 34: case 69: case 76:
            MESHIO__TRY(meshio__add_polygon(r, v, 3, tag));
            break;
        case 6: MESHIO__TRY(meshio__add_strip(r, v, n, tag)); break;
        case 7: case 9: MESHIO__TRY(meshio__add_polygon(r, v, n, tag)); break;
        case 23: case 28: case 30: case 70: case 77:
            MESHIO__TRY(meshio__add_polygon(r, v, 4, tag));
            break;
        case 8:
            MESHIO__TRY(meshio__add_triangle(r, v[0], v[1], v[3], tag));
            MESHIO__TRY(meshio__add_triangle(r, v[0], v[3], v[2], tag));
            break;
        case 10: case 24: case 71: case 78: MESHIO__TRY(meshio__add_tet(r, v, tag)); break;
        case 1: case 2: break; /* points: their vertices are there already */
        default: MESHIO__TRY(meshio__add_solid(r)); break;
        }
    }
    return MESHIO_OK;
}

/* Is this the cell array that holds the tags? */
static int meshio__is_tag_array(const unsigned char *name, size_t length)
{
    return meshio__same(name, length, "region") || meshio__same(name, length, "tag") ||
           meshio__same(name, length, "cellentityids") || meshio__same(name, length, "material") ||
           meshio__same(name, length, "medit:ref") || meshio__same(name, length, "gmsh:physical") ||
           meshio__same(name, length, "cell_scalars"); /* TetGen */
}

static meshio_result meshio__points_scalars(meshio__reader *r, int binary, meshio__type type,
                                            int64_t count)
{
    double xyz[3];
    int64_t i, unused;
    int k;
    MESHIO__TRY(meshio__fits(r, count, 3 * (binary ? meshio__type_size(type) : 2), "points"));
    for (i = 0; i < count; i++) {
        for (k = 0; k < 3; k++) MESHIO__TRY(meshio__scalar(r, binary, type, &xyz[k], &unused));
        MESHIO__TRY(meshio__add_vertex(r, xyz, 0));
    }
    return MESHIO_OK;
}

static meshio_result meshio__cell_corner(meshio__reader *r, int binary, meshio__type type)
{
    double d;
    int64_t index;
    uint32_t v = 0;
    const unsigned char *where;
    if (!binary) meshio__skip(r);
    where = r->p;
    MESHIO__TRY(meshio__scalar(r, binary, type, &d, &index));
    MESHIO__TRY(meshio__vertex(r, where, index, 0, &v));
    return meshio__push32(&r->cells.corners, v) ? MESHIO_OK : meshio__no_memory(r);
}

static meshio_result meshio__cell_end(meshio__reader *r, uint64_t end)
{
    return meshio__push64(&r->cells.ends, end) ? MESHIO_OK : meshio__no_memory(r);
}

/* ---- >>vtk  the legacy format ---------------------------------------------------------------- */

/* Cells before version 5: for each the number of its corners, then the corners. */
static meshio_result meshio__vtk_lists(meshio__reader *r, int binary, int64_t count, int64_t size)
{
    int64_t i, k, n, used = 0;
    double d;
    MESHIO__TRY(meshio__fits(r, size, binary ? 4 : 2, "numbers"));
    for (i = 0; i < count; i++) {
        const unsigned char *where = r->p;
        MESHIO__TRY(meshio__scalar(r, binary, MESHIO__I32, &d, &n));
        if (n < 0 || n > size - used - 1)
            return meshio__fail(r, MESHIO_ERROR_COUNT, where,
                                "a cell of %lld corners, but %lld numbers are left of those "
                                "claimed",
                                (long long)n, (long long)(size - used - 1));
        used += n + 1;
        for (k = 0; k < n; k++) MESHIO__TRY(meshio__cell_corner(r, binary, MESHIO__I32));
        MESHIO__TRY(meshio__cell_end(r, r->cells.corners.num));
    }
    if (used != size)
        return meshio__fail(r, MESHIO_ERROR_COUNT, r->p, "%lld numbers where %lld were claimed",
                            (long long)used, (long long)size);
    return MESHIO_OK;
}

/* Cells of version 5: OFFSETS (one more than there are cells; the first is 0), CONNECTIVITY. */
static meshio_result meshio__vtk_offsets(meshio__reader *r, int binary, int64_t count, int64_t size)
{
    size_t length, first = r->cells.corners.num;
    const unsigned char *word;
    meshio__type type;
    int64_t i, offset, before = 0;
    double d;
    word = meshio__word(r, &length);
    type = meshio__type_named(word, length);
    if (type >= MESHIO__F32) return meshio__fail(r, MESHIO_ERROR_SYNTAX, word, "type of offsets");
    if (binary) meshio__next_line(r);
    MESHIO__TRY(meshio__fits(r, count, binary ? meshio__type_size(type) : 2, "cells"));
    for (i = 0; i < count; i++) {
        const unsigned char *where = r->p;
        MESHIO__TRY(meshio__scalar(r, binary, type, &d, &offset));
        if (offset < before || offset > size || (i == 0 && offset != 0))
            return meshio__fail(r, MESHIO_ERROR_COUNT, where, "offset %lld after %lld",
                                (long long)offset, (long long)before);
        if (i > 0) MESHIO__TRY(meshio__cell_end(r, first + (uint64_t)offset));
        before = offset;
    }
    if (before != size)
        return meshio__fail(r, MESHIO_ERROR_COUNT, r->p, "the last offset is %lld, not %lld",
                            (long long)before, (long long)size);
    MESHIO__TRY(meshio__expect(r, "connectivity"));
    word = meshio__word(r, &length);
    type = meshio__type_named(word, length);
    if (type >= MESHIO__F32)
        return meshio__fail(r, MESHIO_ERROR_SYNTAX, word, "type of the connectivity");
    if (binary) meshio__next_line(r);
    MESHIO__TRY(meshio__fits(r, size, binary ? meshio__type_size(type) : 2, "corners"));
    for (i = 0; i < size; i++) MESHIO__TRY(meshio__cell_corner(r, binary, type));
    return MESHIO_OK;
}

static meshio_result meshio__vtk_cells(meshio__reader *r, int binary, uint32_t type)
{
    int64_t count, size;
    const unsigned char *before;
    size_t length;
    MESHIO__TRY(meshio__int(r, &count));
    MESHIO__TRY(meshio__int(r, &size));
    MESHIO__TRY(meshio__fits(r, count, 2, "cells"));
    MESHIO__TRY(meshio__fits(r, size, 2, "numbers"));
    before = r->p;
    if (meshio__same(meshio__word(r, &length), 7, "offsets") && length == 7) {
        MESHIO__TRY(meshio__vtk_offsets(r, binary, count, size));
    } else {
        r->p = before;
        if (binary) meshio__next_line(r);
        MESHIO__TRY(meshio__vtk_lists(r, binary, count, size));
    }
    while (type && r->cells.types.num < r->cells.ends.num)
        if (!meshio__push32(&r->cells.types, type)) return meshio__no_memory(r);
    return MESHIO_OK;
}

static meshio_result meshio__vtk_cell_types(meshio__reader *r, int binary)
{
    int64_t count, type, i;
    double d;
    MESHIO__TRY(meshio__int(r, &count));
    if (count < 0 || (uint64_t)count != r->cells.ends.num)
        return meshio__fail(r, MESHIO_ERROR_COUNT, r->p, "%lld types for %llu cells",
                            (long long)count, (unsigned long long)r->cells.ends.num);
    if (binary) meshio__next_line(r);
    for (i = 0; i < count; i++) {
        MESHIO__TRY(meshio__scalar(r, binary, MESHIO__I32, &d, &type));
        if (type < 0 || type > 255)
            return meshio__fail(r, MESHIO_ERROR_SYNTAX, r->p, "cell type %lld", (long long)type);
        if (!meshio__push32(&r->cells.types, (uint32_t)type)) return meshio__no_memory(r);
    }
    return MESHIO_OK;
}

/* Skips the METADATA lines that VTK 8 and later write after an array, up to an empty line. First
 * may come COMPONENT_NAMES, with a line for each component of the array, which may be empty. */
static void meshio__vtk_metadata(meshio__reader *r, int64_t components)
{
    size_t length;
    const unsigned char *word;
    meshio__next_line(r);
    if (meshio__more_on_line(r)) {
        word = meshio__word(r, &length);
        if (meshio__same(word, length, "component_names"))
            for (; components > 0 && r->p < r->end; components--) meshio__next_line(r);
        meshio__next_line(r);
    }
    while (meshio__more_on_line(r)) meshio__next_line(r);
}

static int meshio__vtk_is_string(const unsigned char *type, size_t length)
{
    return meshio__same(type, length, "string") || meshio__same(type, length, "utf8_string");
}

/* Skips strings: in text one on each line; in binary each comes after its length, which has 8, 4, 2
 * or 1 bytes if the first two bits are 0, 1, 2 or 3. */
static meshio_result meshio__vtk_strings(meshio__reader *r, int binary, int64_t count)
{
    int64_t i;
    MESHIO__TRY(meshio__fits(r, count, 1, "strings"));
    for (i = 0; i < count; i++) {
        int k, bytes = 8 >> (r->p[0] >> 6);
        uint64_t length = r->p[0] & 63;
        if (r->p == r->end) return meshio__expected(r, "a string");
        if (!binary) {
            meshio__next_line(r);
            continue;
        }
        for (k = 1; k < bytes && r->end - r->p > k; k++) length = length << 8 | r->p[k];
        if (r->end - r->p < bytes || length > (uint64_t)(r->end - r->p - bytes))
            return meshio__fail(r, MESHIO_ERROR_TRUNCATED, r->p, "the file ends in a string");
        r->p += (size_t)bytes + length;
    }
    return MESHIO_OK;
}

/* What an array is said to be. */
typedef struct meshio__vtk_values {
    const unsigned char *where; /* in the file */
    const unsigned char *type;  /* its name, which need not be in the file */
    size_t               type_length;
    int64_t              components, tuples;
} meshio__vtk_values;

/* Reads the values of an array. They are kept if they are the cells' tags, else skipped. */
static meshio_result meshio__vtk_array(meshio__reader *r, int binary, const meshio__vtk_values *a,
                                       int tags)
{
    meshio__type t = meshio__type_named(a->type, a->type_length);
    int64_t count = a->tuples, i, value;
    unsigned char bytes[8];
    double d;
    if (a->components < 0 || count < 0 || (a->components && count > INT64_MAX / 16 / a->components))
        return meshio__fail(r, MESHIO_ERROR_COUNT, a->where, "an array of %lld times %lld values",
                            (long long)count, (long long)a->components);
    count *= a->components;
    if (meshio__vtk_is_string(a->type, a->type_length))
        return meshio__vtk_strings(r, binary, count);
    if (meshio__same(a->type, a->type_length, "bit")) {
        t = MESHIO__U8;
        if (binary) count = (count + 7) / 8;
        tags = 0;
    }
    if (t == MESHIO__NO_TYPE)
        return meshio__fail(r, MESHIO_ERROR_UNSUPPORTED, a->where, "an array of an unknown type");
    MESHIO__TRY(meshio__fits(r, count, binary ? meshio__type_size(t) : 2, "values"));
    if (binary && !tags) return meshio__bytes(r, bytes, (size_t)count * meshio__type_size(t));
    for (i = 0; i < count && tags; i++) {
        MESHIO__TRY(meshio__scalar(r, binary, t, &d, &value));
        MESHIO__TRY(meshio__tag_fits(r, value));
        if (!meshio__push32(&r->cells.tags, (uint32_t)value)) return meshio__no_memory(r);
    }
    for (i = 0; i < count && !tags && !binary; i++) MESHIO__TRY(meshio__double(r, &d));
    return MESHIO_OK;
}

/* The state from one section to the next. */
typedef struct meshio__vtk {
    int binary, have_points;
    int data;      /* what the attributes belong to: points, 'p', or cells, 'c'; 0 before either */
    int64_t count; /* the number of these points or cells */
    int64_t components; /* of the array before */
} meshio__vtk;

/* Does an array of this name hold the tags, if it has one value for each cell? */
static int meshio__vtk_is_tags(const meshio__reader *r, const meshio__vtk *vtk,
                               const unsigned char *name, size_t length)
{
    return vtk->data == 'c' && r->cells.tags.num == 0 && meshio__is_tag_array(name, length);
}

/* FIELD name n, then n arrays: name, components, tuples, type, values. */
static meshio_result meshio__vtk_field(meshio__reader *r, meshio__vtk *vtk)
{
    meshio__vtk_values a;
    int64_t arrays, i;
    size_t length;
    const unsigned char *name;
    meshio__word(r, &length);
    MESHIO__TRY(meshio__int(r, &arrays));
    MESHIO__TRY(meshio__fits(r, arrays, 2, "arrays"));
    for (i = 0; i < arrays; i++) {
        name = meshio__word(r, &length);
        if (meshio__same(name, length, "metadata") && !meshio__more_on_line(r)) {
            meshio__vtk_metadata(r, vtk->components);
            name = meshio__word(r, &length);
        }
        if (meshio__same(name, length, "null_array")) continue;
        MESHIO__TRY(meshio__int(r, &a.components));
        MESHIO__TRY(meshio__int(r, &a.tuples));
        a.where = a.type = meshio__word(r, &a.type_length);
        if (vtk->binary || meshio__vtk_is_string(a.type, a.type_length)) meshio__next_line(r);
        MESHIO__TRY(meshio__vtk_array(r, vtk->binary, &a,
                                      a.components == 1 && a.tuples == vtk->count &&
                                          meshio__vtk_is_tags(r, vtk, name, length)));
        vtk->components = a.components;
    }
    return MESHIO_OK;
}

/* SCALARS name type [components], LOOKUP_TABLE name, values. */
static meshio_result meshio__vtk_scalars(meshio__reader *r, meshio__vtk *vtk)
{
    size_t length, unused;
    const unsigned char *name = meshio__word(r, &length);
    meshio__vtk_values a;
    a.where = a.type = meshio__word(r, &a.type_length);
    a.components = 1;
    a.tuples = vtk->count;
    if (meshio__more_on_line(r)) MESHIO__TRY(meshio__int(r, &a.components));
    MESHIO__TRY(meshio__expect(r, "lookup_table"));
    meshio__word(r, &unused);
    if (vtk->binary) meshio__next_line(r);
    vtk->components = a.components;
    return meshio__vtk_array(r, vtk->binary, &a,
                             a.components == 1 && meshio__vtk_is_tags(r, vtk, name, length));
}

/* Skips any other attribute of points or cells. */
static meshio_result meshio__vtk_attribute(meshio__reader *r, meshio__vtk *vtk,
                                           const unsigned char *word, size_t length)
{
    static const struct {
        const char *name;
        int components; /* 0: the file gives their number */
        int bytes;      /* nonzero: values without a type, bytes in binary; 4: always 4 tuples */
    } kinds[] = {{"vectors", 3, 0},      {"normals", 3, 0},  {"tensors", 9, 0},
                 {"tensors6", 6, 0},     {"global_ids", 1, 0}, {"pedigree_ids", 1, 0},
                 {"edge_flags", 1, 0},   {"texture_coordinates", 0, 0},
                 {"color_scalars", 0, 1}, {"lookup_table", 0, 4}};
    static const unsigned char uchar[] = "uchar", real[] = "float";
    meshio__vtk_values a;
    size_t k, unused;
    for (k = 0; k < sizeof kinds / sizeof kinds[0]; k++)
        if (meshio__same(word, length, kinds[k].name)) break;
    if (vtk->data == 0 || k == sizeof kinds / sizeof kinds[0]) {
        r->p = word;
        return meshio__expected(r, "a keyword of a legacy VTK file");
    }
    a.where = word;
    a.type = vtk->binary ? uchar : real;
    a.type_length = sizeof uchar - 1; /* that of "float", too */
    a.components = kinds[k].components;
    a.tuples = kinds[k].bytes == 4 ? 4 : vtk->count;
    meshio__word(r, &unused); /* the attribute's own name */
    if (a.components == 0) MESHIO__TRY(meshio__int(r, &a.components));
    if (kinds[k].bytes == 0) a.type = meshio__word(r, &a.type_length);
    if (vtk->binary) meshio__next_line(r);
    vtk->components = a.components;
    return meshio__vtk_array(r, vtk->binary, &a, 0);
}

static meshio_result meshio__vtk_points(meshio__reader *r, meshio__vtk *vtk,
                                        const unsigned char *word)
{
    int64_t count;
    size_t length;
    meshio__type type;
    if (vtk->have_points++) return meshio__fail(r, MESHIO_ERROR_SYNTAX, word, "POINTS again");
    MESHIO__TRY(meshio__int(r, &count));
    word = meshio__word(r, &length);
    type = meshio__type_named(word, length);
    if (type == MESHIO__NO_TYPE)
        return meshio__fail(r, MESHIO_ERROR_UNSUPPORTED, word, "points of an unknown type");
    if (vtk->binary) meshio__next_line(r);
    vtk->components = 3;
    return meshio__points_scalars(r, vtk->binary, type, count);
}

/* CELL_DATA or POINT_DATA, with the number of cells or points. */
static meshio_result meshio__vtk_data(meshio__reader *r, meshio__vtk *vtk, int data)
{
    const unsigned char *where = r->p;
    uint64_t due = data == 'c' ? r->cells.ends.num : r->mesh->num_vertices;
    MESHIO__TRY(meshio__int(r, &vtk->count));
    vtk->data = data;
    if (vtk->count < 0 || (uint64_t)vtk->count != due)
        return meshio__fail(r, MESHIO_ERROR_COUNT, where, "data of %lld %s, but there are %llu",
                            (long long)vtk->count, data == 'c' ? "cells" : "points",
                            (unsigned long long)due);
    return MESHIO_OK;
}

/* Reads the section that begins with this word. */
static meshio_result meshio__vtk_section(meshio__reader *r, meshio__vtk *vtk,
                                         const unsigned char *word, size_t length)
{
    static const struct {
        const char *name;
        uint32_t type;
    } cells[] = {{"polygons", 7}, {"triangle_strips", 6}, {"lines", 4}, {"vertices", 2},
                 {"cells", 0}};
    size_t k;
    for (k = 0; k < sizeof cells / sizeof cells[0]; k++)
        if (meshio__same(word, length, cells[k].name))
            return meshio__vtk_cells(r, vtk->binary, cells[k].type);
    if (meshio__same(word, length, "points")) return meshio__vtk_points(r, vtk, word);
    if (meshio__same(word, length, "cell_types")) return meshio__vtk_cell_types(r, vtk->binary);
    if (meshio__same(word, length, "cell_data")) return meshio__vtk_data(r, vtk, 'c');
    if (meshio__same(word, length, "point_data")) return meshio__vtk_data(r, vtk, 'p');
    if (meshio__same(word, length, "field")) return meshio__vtk_field(r, vtk);
    if (meshio__same(word, length, "metadata")) {
        meshio__vtk_metadata(r, vtk->components);
        return MESHIO_OK;
    }
    if (vtk->data && meshio__same(word, length, "scalars")) return meshio__vtk_scalars(r, vtk);
    return meshio__vtk_attribute(r, vtk, word, length);
}

static meshio_result meshio__read_vtk(meshio__reader *r)
{
    meshio__vtk vtk;
    size_t length;
    const unsigned char *word;
    memset(&vtk, 0, sizeof vtk);
    r->text = 1;
    if (r->begin == r->end) return meshio__expected(r, "# vtk DataFile Version");
    if (r->end - r->p < 22 || !meshio__same(r->p, 22, "# vtk datafile version"))
        return meshio__fail(r, MESHIO_ERROR_FORMAT, r->p, "no '# vtk DataFile Version'");
    meshio__next_line(r);
    meshio__next_line(r);
    word = meshio__word(r, &length);
    vtk.binary = meshio__same(word, length, "binary");
    if (!vtk.binary && !meshio__same(word, length, "ascii")) {
        r->p = word;
        return meshio__expected(r, "ASCII or BINARY");
    }
    r->swap = meshio__little_endian();
    MESHIO__TRY(meshio__expect(r, "dataset"));
    word = meshio__word(r, &length);
    if (!meshio__same(word, length, "polydata") && !meshio__same(word, length, "unstructured_grid"))
        return meshio__fail(r, MESHIO_ERROR_UNSUPPORTED, word,
                            "only POLYDATA and UNSTRUCTURED_GRID are read");
    if (vtk.binary) r->text = 0;
    while ((word = meshio__word(r, &length), length) != 0)
        MESHIO__TRY(meshio__vtk_section(r, &vtk, word, length));
    if (!vtk.have_points) return meshio__expected(r, "POINTS");
    if (r->cells.types.num != r->cells.ends.num) return meshio__expected(r, "CELL_TYPES");
    return meshio__cells_store(r);
}

/* ---- >>inflate  zlib streams, base64 --------------------------------------------------------- */

/* A canonical prefix code: count[k] codes have k bits; the symbols are in the order of their codes.
 * fast[b]: 16 * symbol + length of the code that the next 9 bits b begin with; 0 if it is longer or
 * there is none. */
enum { MESHIO__FAST_BITS = 9 };
typedef struct meshio__code {
    uint16_t fast[1 << MESHIO__FAST_BITS], count[16], symbols[288];
} meshio__code;

/* A stream of bits: the next ones are in `bits`, the lowest first, the rest at p. */
typedef struct meshio__bits {
    const unsigned char *p, *end;
    uint64_t bits;
    int num;
} meshio__bits;

/* Builds the code whose symbol i has lengths[i] bits, 0 if it does not occur. Returns 0 if there
 * are more codes than such lengths allow. */
static int meshio__code_build(meshio__code *code, const unsigned char *lengths, int n)
{
    int i, k, left = 1, offset[17] = {0}, next[17] = {0};
    memset(code, 0, sizeof *code);
    for (i = 0; i < n; i++) code->count[lengths[i]]++;
    code->count[0] = 0;
    for (k = 1; k < 16; k++) {
        left = 2 * left - code->count[k];
        if (left < 0) return 0;
        offset[k + 1] = offset[k] + code->count[k];
        next[k + 1] = (next[k] + code->count[k]) << 1;
    }
    for (i = 0; i < n; i++) {
        int length = lengths[i], bits, reversed = 0;
        if (length == 0) continue;
        code->symbols[offset[length]++] = (uint16_t)i;
        bits = next[length]++;
        if (length > MESHIO__FAST_BITS) continue;
        for (k = 0; k < length; k++) reversed |= (bits >> k & 1) << (length - 1 - k);
        for (; reversed < 1 << MESHIO__FAST_BITS; reversed += 1 << length)
            code->fast[reversed] = (uint16_t)(16 * i + length);
    }
    return 1;
}

static void meshio__bits_fill(meshio__bits *b)
{
    for (; b->num <= 56 && b->p < b->end; b->num += 8) b->bits |= (uint64_t)*b->p++ << b->num;
}

/* The next n bits, at most 16; -1 if fewer are left. */
static int meshio__bits_take(meshio__bits *b, int n)
{
    int value;
    if (b->num < n) meshio__bits_fill(b);
    if (b->num < n) return -1;
    value = (int)(b->bits & ((UINT64_C(1) << n) - 1));
    b->bits >>= n;
    b->num -= n;
    return value;
}

/* The next symbol; -1 if the bits end or are no code. */
static int meshio__code_take(meshio__bits *b, const meshio__code *code)
{
    int k, bits = 0, first = 0, index = 0, entry;
    if (b->num < 15) meshio__bits_fill(b);
    entry = code->fast[b->bits & ((1 << MESHIO__FAST_BITS) - 1)];
    if (entry) return meshio__bits_take(b, entry & 15) < 0 ? -1 : entry >> 4;
    for (k = 1; k < 16; k++) {
        int bit = meshio__bits_take(b, 1);
        if (bit < 0) return -1;
        bits = bits << 1 | bit;
        first <<= 1;
        if (bits - first < code->count[k]) return code->symbols[index + bits - first];
        first += code->count[k];
        index += code->count[k];
    }
    return -1;
}

/* The codes of a block: of kind 1 the fixed ones, of kind 2 those that come with it. Returns 0 if
 * these are invalid. */
static int meshio__block_codes(meshio__bits *b, int kind, meshio__code *literals,
                               meshio__code *distances)
{
    static const unsigned char order[19] = {16, 17, 18, 0, 8,  7, 9,  6, 10, 5,
                                            11, 4,  12, 3, 13, 2, 14, 1, 15};
    unsigned char lengths[320];
    int i, num_literals = 288, num_distances = 30, num, n = 0;
    memset(lengths, 0, sizeof lengths);
    if (kind == 1) {
        for (i = 0; i < 288; i++)
            lengths[i] = (unsigned char)(i < 144 ? 8 : i < 256 ? 9 : i < 280 ? 7 : 8);
        memset(lengths + 288, 5, 30);
    } else {
        num_literals = meshio__bits_take(b, 5) + 257;
        num_distances = meshio__bits_take(b, 5) + 1;
        num = meshio__bits_take(b, 4) + 4;
        if (num < 4 || num_literals > 286) return 0; /* num is 3 if the bits have ended */
        for (i = 0; i < num; i++) {
            int length = meshio__bits_take(b, 3);
            if (length < 0) return 0;
            lengths[order[i]] = (unsigned char)length;
        }
        if (!meshio__code_build(distances, lengths, 19)) return 0;
        memset(lengths, 0, sizeof lengths);
        while (n < num_literals + num_distances) {
            int symbol = meshio__code_take(b, distances), repeat = 1, extra = 0, value = 0;
            if (symbol < 0 || (symbol == 16 && n == 0)) return 0;
            if (symbol < 16) value = symbol;
            if (symbol == 16) value = lengths[n - 1], repeat = 3, extra = 2;
            if (symbol == 17) repeat = 3, extra = 3;
            if (symbol == 18) repeat = 11, extra = 7;
            extra = meshio__bits_take(b, extra);
            if (extra < 0 || repeat + extra > num_literals + num_distances - n) return 0;
            for (repeat += extra; repeat > 0; repeat--) lengths[n++] = (unsigned char)value;
        }
    }
    return meshio__code_build(literals, lengths, num_literals) &&
           meshio__code_build(distances, lengths + num_literals, num_distances);
}

/* Decodes the symbols of a block up to its end; *n is the number of bytes in `out`. Returns 0 if
 * they are invalid, or make more than `size` bytes. */
static int meshio__block_symbols(meshio__bits *b, const meshio__code *literals,
                                 const meshio__code *distances, unsigned char *out, size_t size,
                                 size_t *n)
{
    static const uint16_t back[30] = {
        1,   2,   3,   4,   5,   7,    9,    13,   17,   25,   33,   49,   65,    97,    129,
        193, 257, 385, 513, 769, 1025, 1537, 2049, 3073, 4097, 6145, 8193, 12289, 16385, 24577};
    static const uint16_t longer[29] = {3,  4,  5,  6,  7,  8,  9,  10,  11,  13,
                                        15, 17, 19, 23, 27, 31, 35, 43,  51,  59,
                                        67, 83, 99, 115, 131, 163, 195, 227, 258};
    for (;;) {
        int symbol = meshio__code_take(b, literals), length, distance, extra;
        if (symbol < 0 || symbol > 285) return 0;
        if (symbol == 256) return 1;
        if (symbol < 256) {
            if (*n == size) return 0;
            out[(*n)++] = (unsigned char)symbol;
            continue;
        }
        symbol -= 257;
        extra = meshio__bits_take(b, symbol < 8 || symbol == 28 ? 0 : (symbol - 4) / 4);
        length = longer[symbol] + extra;
        if (extra < 0) return 0;
        symbol = meshio__code_take(b, distances);
        if (symbol < 0 || symbol > 29) return 0;
        extra = meshio__bits_take(b, symbol < 4 ? 0 : (symbol - 2) / 2);
        distance = back[symbol] + extra;
        if (extra < 0 || (size_t)distance > *n || (size_t)length > size - *n) return 0;
        for (; length > 0; length--, (*n)++) out[*n] = out[*n - (size_t)distance];
    }
}

/* Decompresses a zlib stream [RFC 1950, 1951]. Returns 0 if it is invalid or does not hold exactly
 * `size` bytes. */
static int meshio__inflate(const unsigned char *p, const unsigned char *end, unsigned char *out,
                           size_t size)
{
    meshio__code literals, distances;
    meshio__bits b;
    size_t n = 0, i;
    uint32_t low = 1, high = 0, sum = 0;
    int last, kind, k;
    if (end - p < 6 || (p[0] & 15) != 8 || (p[0] << 8 | p[1]) % 31 != 0 || (p[1] & 32)) return 0;
    b.p = p + 2;
    b.end = end;
    b.bits = 0;
    b.num = 0;
    do {
        last = meshio__bits_take(&b, 1);
        kind = meshio__bits_take(&b, 2);
        if (kind < 0 || kind > 2) return 0;
        if (kind == 0) { /* bytes that are not compressed, from a byte boundary on */
            int length, check;
            meshio__bits_take(&b, b.num & 7);
            length = meshio__bits_take(&b, 16);
            check = meshio__bits_take(&b, 16);
            if (check < 0 || (length ^ check) != 0xFFFF || (size_t)length > size - n) return 0;
            for (; length > 0; length--) {
                int byte = meshio__bits_take(&b, 8);
                if (byte < 0) return 0;
                out[n++] = (unsigned char)byte;
            }
        } else if (!meshio__block_codes(&b, kind, &literals, &distances) ||
                   !meshio__block_symbols(&b, &literals, &distances, out, size, &n)) {
            return 0;
        }
    } while (!last);
    meshio__bits_take(&b, b.num & 7);
    for (k = 0; k < 4; k++) {
        int byte = meshio__bits_take(&b, 8);
        if (byte < 0) return 0;
        sum = sum << 8 | (uint32_t)byte;
    }
    for (i = 0; i < n; i++) {
        low += out[i];
        high += low;
        if (i % 5000 == 4999) low %= 65521, high %= 65521; /* before the sums can overflow */
    }
    low %= 65521;
    high %= 65521;
    return n == size && sum == (high << 16 | low);
}

static int meshio__base64_digit(int c)
{
    if (c >= 'A' && c <= 'Z') return c - 'A';
    if (c >= 'a' && c <= 'z') return c - 'a' + 26;
    if (meshio__is_digit(c)) return c - '0' + 52;
    return c == '+' ? 62 : c == '/' ? 63 : -1;
}

/* Decodes `size` bytes of base64 text, which may have padding in between. Returns the position
 * after it, NULL if the text ends early or has another character. */
static const unsigned char *meshio__base64(const unsigned char *p, const unsigned char *end,
                                           unsigned char *out, size_t size)
{
    size_t n = 0;
    while (n < size) {
        int k, digit, pad = 0;
        uint32_t group = 0;
        for (k = 0; k < 4; k++) {
            while (p < end && meshio__is_space(*p)) p++;
            if (p == end) return NULL;
            digit = meshio__base64_digit(*p);
            if (digit < 0 && *p == '=' && k > 1) pad++;
            else if (digit < 0 || pad) return NULL;
            group = group << 6 | (uint32_t)(digit < 0 ? 0 : digit);
            p++;
        }
        for (k = 0; k < 3 - pad && n < size; k++)
            out[n++] = (unsigned char)(group >> (16 - 8 * k));
    }
    return p;
}

/* ---- >>vtu  one piece, ASCII or binary ------------------------------------------------------- */

typedef struct meshio__vtu {
    const unsigned char *appended; /* the appended data, after the '_'; NULL if there are none */
    const unsigned char *end;      /* of the file */
    int raw;                       /* the appended data are not in base64 */
    int wide;                      /* header_type is UInt64 */
    int zlib;
    int pieces;
    int64_t points, cells;
} meshio__vtu;

/* The value of an attribute of the XML tag in [tag, end); NULL if the tag does not have it. */
static const unsigned char *meshio__attribute(const unsigned char *tag, const unsigned char *end,
                                              const char *name, size_t *length)
{
    size_t n = strlen(name);
    const unsigned char *p, *q;
    for (p = tag + 1; p + n + 2 < end; p++) {
        if (!meshio__is_space(p[-1]) || !meshio__same(p, n, name)) continue;
        q = p + n;
        while (q < end && meshio__is_space(*q)) q++;
        if (q == end || *q++ != '=') continue;
        while (q < end && meshio__is_space(*q)) q++;
        if (q == end || (*q != '"' && *q != '\'')) continue;
        p = q + 1;
        q = (const unsigned char *)memchr(p, *q, (size_t)(end - p));
        if (!q) return NULL;
        *length = (size_t)(q - p);
        return p;
    }
    return NULL;
}

/* The '>' that ends the XML tag or comment at p; NULL if there is none. In a quoted value it ends
 * nothing. */
static const unsigned char *meshio__tag_end(const unsigned char *p, const unsigned char *end)
{
    const int comment = end - p > 6 && memcmp(p, "<!--", 4) == 0;
    const unsigned char *q;
    if (comment) {
        for (q = p + 4; q + 2 < end; q++)
            if (memcmp(q, "-->", 3) == 0) return q + 2;
        return NULL;
    }
    for (q = p; q < end && *q != '>'; q++)
        if (*q == '"' || *q == '\'') {
            q = (const unsigned char *)memchr(q + 1, *q, (size_t)(end - q - 1));
            if (!q) return NULL;
        }
    return q < end ? q : NULL;
}

static meshio_result meshio__attribute_int(meshio__reader *r, const unsigned char *tag,
                                           const unsigned char *end, const char *name,
                                           int64_t *value)
{
    size_t length, i;
    const unsigned char *text = meshio__attribute(tag, end, name, &length);
    if (!text || length == 0 || length > 18)
        return meshio__fail(r, MESHIO_ERROR_SYNTAX, tag, "no proper %s in this tag", name);
    for (*value = 0, i = 0; i < length; i++) {
        if (!meshio__is_digit(text[i]))
            return meshio__fail(r, MESHIO_ERROR_SYNTAX, text, "%s is not a count", name);
        *value = 10 * *value + (text[i] - '0');
    }
    return MESHIO_OK;
}

/* Integer k of the header that precedes an array's data. */
static uint64_t meshio__vtu_word(const meshio__reader *r, const meshio__vtu *vtu,
                                 const unsigned char *header, size_t k)
{
    size_t size = vtu->wide ? 8 : 4, i;
    uint64_t word = 0;
    int little = meshio__little_endian() != r->swap;
    for (i = 0; i < size; i++)
        word = word << 8 | header[k * size + (little ? size - 1 - i : i)];
    return word;
}

static int meshio__reserve_bytes(unsigned char **bytes, size_t *cap, size_t need)
{
    void *data = *bytes;
    if (!meshio__reserve(&data, cap, need, 1)) return 0;
    *bytes = (unsigned char *)data;
    return 1;
}

/* Decodes `size` bytes of base64 text at *p into r->packed, from byte `at` on; *p moves to the end
 * of the text. */
static meshio_result meshio__vtu_decode(meshio__reader *r, const unsigned char **p, size_t at,
                                        uint64_t size)
{
    if (size > (uint64_t)(r->end - *p))
        return meshio__fail(r, MESHIO_ERROR_COUNT, *p, "%llu bytes of data, but only %llu are left",
                            (unsigned long long)size, (unsigned long long)(r->end - *p));
    if (!meshio__reserve_bytes(&r->packed, &r->cap_packed, at + (size_t)size + 1))
        return meshio__no_memory(r);
    *p = meshio__base64(*p, r->end, r->packed + at, (size_t)size);
    if (!*p) return meshio__fail(r, MESHIO_ERROR_SYNTAX, r->p, "the base64 data end early");
    return MESHIO_OK;
}

/* Puts the cursor on decoded bytes of the array with this tag. */
static void meshio__vtu_aside(meshio__reader *r, const unsigned char *tag,
                              const unsigned char *bytes, size_t size)
{
    r->aside = tag;
    r->p = bytes;
    r->end = bytes + size;
}

/* Decompresses an array of this many bytes and puts the cursor on it. The data are: the number of
 * blocks, the size of a block, the size of the last one (0: the same), and the compressed size of
 * each block; then the blocks. `text`: they are in base64. */
static meshio_result meshio__vtu_inflate(meshio__reader *r, const meshio__vtu *vtu, int text,
                                         const unsigned char *tag, uint64_t bytes)
{
    const unsigned char *p = r->p, *header = p, *from;
    uint64_t blocks, size, rest, packed = 0, left = (uint64_t)(r->end - p), i;
    size_t word = vtu->wide ? 8 : 4, done = 0, head;
    if (text) MESHIO__TRY(meshio__vtu_decode(r, &p, 0, word));
    if (text) header = r->packed, p = r->p;
    if (left < word) return meshio__expected(r, "the size of the data");
    blocks = meshio__vtu_word(r, vtu, header, 0);
    if (blocks > left / word || (blocks + 3) * word > left)
        return meshio__fail(r, MESHIO_ERROR_COUNT, r->p, "%llu blocks of data, but only %llu bytes "
                                                         "are left",
                            (unsigned long long)blocks, (unsigned long long)left);
    if (blocks == 0 && bytes == 0) {
        meshio__vtu_aside(r, tag, header, 0);
        return MESHIO_OK;
    }
    head = (size_t)(blocks + 3) * word;
    if (text) MESHIO__TRY(meshio__vtu_decode(r, &p, 0, head));
    header = text ? r->packed : p;
    size = meshio__vtu_word(r, vtu, header, 1);
    rest = meshio__vtu_word(r, vtu, header, 2);
    if (rest == 0) rest = size;
    for (i = 0; i < blocks; i++) {
        uint64_t one = meshio__vtu_word(r, vtu, header, 3 + (size_t)i);
        packed = one > left || packed > left ? left + 1 : packed + one;
    }
    if (packed > left)
        return meshio__fail(r, MESHIO_ERROR_COUNT, r->p, "blocks of more bytes than are left");
    if ((blocks == 0 && bytes != 0) || (blocks > 1 && size > bytes / (blocks - 1)) ||
        (blocks > 0 && (blocks - 1) * size + rest != bytes) || bytes / 1040 > packed)
        return meshio__fail(r, MESHIO_ERROR_COUNT, r->p,
                            "%llu blocks of %llu bytes where there should be %llu bytes",
                            (unsigned long long)blocks, (unsigned long long)size,
                            (unsigned long long)bytes); /* zlib's ratio is at most 1032 */
    if (text) MESHIO__TRY(meshio__vtu_decode(r, &p, head, packed));
    header = text ? r->packed : p;
    from = header + head;
    if (!text && packed > left - head)
        return meshio__fail(r, MESHIO_ERROR_COUNT, r->p, "blocks of more bytes than are left");
    if (bytes > (size_t)-1 / 2 ||
        !meshio__reserve_bytes(&r->decoded, &r->cap_decoded, (size_t)bytes + 1))
        return meshio__no_memory(r);
    for (i = 0; i < blocks; i++) {
        size_t in = (size_t)meshio__vtu_word(r, vtu, header, 3 + (size_t)i);
        size_t out = (size_t)(i + 1 < blocks ? size : rest);
        if (!meshio__inflate(from, from + in, r->decoded + done, out))
            return meshio__fail(r, MESHIO_ERROR_SYNTAX, r->p,
                                "block %llu of the compressed data is damaged",
                                (unsigned long long)i);
        from += in;
        done += out;
    }
    meshio__vtu_aside(r, tag, r->decoded, (size_t)bytes);
    return MESHIO_OK;
}

/* Puts the cursor on the data of an array that must hold `count` values. */
static meshio_result meshio__vtu_open(meshio__reader *r, const meshio__vtu *vtu,
                                      const unsigned char *tag, const unsigned char *end,
                                      uint64_t count, meshio__type *type, int *binary)
{
    size_t length, word = vtu->wide ? 8 : 4;
    const unsigned char *text = meshio__attribute(tag, end, "type", &length), *p;
    int64_t offset;
    uint64_t bytes;
    int appended;
    *type = text ? meshio__type_named(text, length) : MESHIO__NO_TYPE;
    if (*type == MESHIO__NO_TYPE)
        return meshio__fail(r, MESHIO_ERROR_UNSUPPORTED, tag, "unknown type of a DataArray");
    text = meshio__attribute(tag, end, "format", &length);
    appended = text && meshio__same(text, length, "appended");
    *binary = appended || (text && meshio__same(text, length, "binary"));
    r->p = end + 1;
    if (!*binary) {
        if (text && !meshio__same(text, length, "ascii"))
            return meshio__fail(r, MESHIO_ERROR_UNSUPPORTED, tag,
                                "only ascii, binary and appended data");
        return MESHIO_OK;
    }
    if (appended) {
        MESHIO__TRY(meshio__attribute_int(r, tag, end, "offset", &offset));
        if (!vtu->appended || offset > (int64_t)(r->end - vtu->appended))
            return meshio__fail(r, MESHIO_ERROR_TRUNCATED, tag, "the appended data are missing");
        r->p = vtu->appended + offset;
    }
    if (count > MESHIO__MAX_COUNT * UINT64_C(16))
        return meshio__fail(r, MESHIO_ERROR_TOO_LARGE, tag, "an array of 2^36 values or more");
    bytes = count * meshio__type_size(*type);
    if (vtu->zlib) return meshio__vtu_inflate(r, vtu, !appended || !vtu->raw, tag, bytes);
    p = r->p;
    if (!appended || !vtu->raw) {
        MESHIO__TRY(meshio__vtu_decode(r, &p, 0, word));
    } else if ((size_t)(r->end - p) < word) {
        return meshio__expected(r, "the size of the data");
    }
    offset = (int64_t)(meshio__vtu_word(r, vtu, appended && vtu->raw ? p : r->packed, 0) &
                       INT64_MAX);
    if ((uint64_t)offset != bytes)
        return meshio__fail(r, MESHIO_ERROR_COUNT, r->p, "%lld bytes for %llu values",
                            (long long)offset, (unsigned long long)count);
    if (appended && vtu->raw) {
        r->p += word;
        return MESHIO_OK;
    }
    p = r->p;
    MESHIO__TRY(meshio__vtu_decode(r, &p, 0, word + bytes));
    meshio__vtu_aside(r, tag, r->packed + word, (size_t)bytes);
    return MESHIO_OK;
}

/* After the last value of an array: puts the cursor back on the file. An array in text must end
 * here. */
static meshio_result meshio__vtu_close(meshio__reader *r, const meshio__vtu *vtu, int binary)
{
    if (r->aside) {
        r->p = r->aside;
        r->aside = NULL;
        r->end = vtu->end;
    } else if (!binary) {
        meshio__skip(r);
        if (*r->p != '<') return meshio__expected(r, "the end of the array");
    }
    return MESHIO_OK;
}

static meshio_result meshio__vtu_array(meshio__reader *r, const meshio__vtu *vtu, int section,
                                       const unsigned char *tag, const unsigned char *end)
{
    size_t length = 0, text_length;
    const unsigned char *name = meshio__attribute(tag, end, "name", &length), *text;
    meshio__type type;
    int64_t i, value, size;
    double d;
    int binary;
    if (section == 'p') {
        if (r->mesh->num_vertices)
            return meshio__fail(r, MESHIO_ERROR_SYNTAX, tag, "a second array of points");
        MESHIO__TRY(meshio__vtu_open(r, vtu, tag, end, 3 * (uint64_t)vtu->points, &type, &binary));
        MESHIO__TRY(meshio__points_scalars(r, binary, type, vtu->points));
        return meshio__vtu_close(r, vtu, binary);
    }
    if (!name) return MESHIO_OK;
    text = meshio__attribute(tag, end, "numberofcomponents", &text_length);
    if (section == 'd' && meshio__is_tag_array(name, length) && r->cells.tags.num == 0 &&
        (!text || (text_length == 1 && *text == '1'))) {
        MESHIO__TRY(meshio__vtu_open(r, vtu, tag, end, (uint64_t)vtu->cells, &type, &binary));
        for (i = 0; i < vtu->cells; i++) {
            MESHIO__TRY(meshio__scalar(r, binary, type, &d, &value));
            MESHIO__TRY(meshio__tag_fits(r, value));
            if (!meshio__push32(&r->cells.tags, (uint32_t)value)) return meshio__no_memory(r);
        }
        return meshio__vtu_close(r, vtu, binary);
    } else if (section == 'c' && meshio__same(name, length, "offsets")) {
        if (r->cells.ends.num)
            return meshio__fail(r, MESHIO_ERROR_SYNTAX, tag, "a second array of offsets");
        MESHIO__TRY(meshio__vtu_open(r, vtu, tag, end, (uint64_t)vtu->cells, &type, &binary));
        for (size = 0, i = 0; i < vtu->cells; i++) {
            MESHIO__TRY(meshio__scalar(r, binary, type, &d, &value));
            if (value < size)
                return meshio__fail(r, MESHIO_ERROR_COUNT, tag, "the offsets decrease");
            size = value;
            MESHIO__TRY(meshio__cell_end(r, (uint64_t)value));
        }
        return meshio__vtu_close(r, vtu, binary);
    } else if (section == 'c' && meshio__same(name, length, "types")) {
        if (r->cells.types.num)
            return meshio__fail(r, MESHIO_ERROR_SYNTAX, tag, "a second array of types");
        MESHIO__TRY(meshio__vtu_open(r, vtu, tag, end, (uint64_t)vtu->cells, &type, &binary));
        for (i = 0; i < vtu->cells; i++) {
            MESHIO__TRY(meshio__scalar(r, binary, type, &d, &value));
            if (!meshio__push32(&r->cells.types, (uint32_t)value)) return meshio__no_memory(r);
        }
        return meshio__vtu_close(r, vtu, binary);
    }
    return MESHIO_OK;
}

/* Reads the corners of the cells, after the offsets, which give their number. */
static meshio_result meshio__vtu_corners(meshio__reader *r, const meshio__vtu *vtu,
                                         const unsigned char *tag)
{
    uint64_t size = r->cells.ends.num ? r->cells.ends.data[r->cells.ends.num - 1] : 0, i;
    const unsigned char *end;
    meshio__type type;
    int binary;
    if (vtu->cells == 0) return MESHIO_OK;
    if (!tag || r->cells.ends.num != (uint64_t)vtu->cells ||
        r->cells.types.num != (uint64_t)vtu->cells)
        return meshio__expected(r, "connectivity, offsets and types of the cells");
    end = meshio__tag_end(tag, r->end);
    MESHIO__TRY(meshio__vtu_open(r, vtu, tag, end, size, &type, &binary));
    MESHIO__TRY(meshio__fits(r, (int64_t)(size & INT64_MAX), binary ? meshio__type_size(type) : 2,
                             "corners"));
    for (i = 0; i < size; i++) MESHIO__TRY(meshio__cell_corner(r, binary, type));
    return meshio__vtu_close(r, vtu, binary);
}

/* Finds the appended data, which may have bytes that look like tags: *at is where their tag
 * begins, NULL: there are none. */
static meshio_result meshio__vtu_find_appended(meshio__reader *r, meshio__vtu *vtu,
                                               const unsigned char **at)
{
    const unsigned char *p, *data, *end, *text;
    size_t length;
    *at = NULL;
    for (p = r->begin; p + 13 < r->end && memcmp(p, "<AppendedData", 13) != 0; p++) {}
    if (p + 13 >= r->end) return MESHIO_OK;
    *at = p;
    data = (const unsigned char *)memchr(p, '_', (size_t)(r->end - p));
    end = (const unsigned char *)memchr(p, '>', (size_t)(r->end - p));
    if (!data || !end || data < end) return meshio__expected(r, "'_' before the appended data");
    text = meshio__attribute(p, end, "encoding", &length);
    vtu->raw = text && meshio__same(text, length, "raw");
    vtu->appended = data + 1;
    return MESHIO_OK;
}

/* Reads the tag <VTKFile>, which says how arrays are stored. */
static meshio_result meshio__vtu_file(meshio__reader *r, meshio__vtu *vtu,
                                      const unsigned char *tag, const unsigned char *end)
{
    size_t length;
    const unsigned char *text = meshio__attribute(tag, end, "type", &length);
    if (!text || !meshio__same(text, length, "unstructuredgrid"))
        return meshio__fail(r, MESHIO_ERROR_UNSUPPORTED, tag, "not an UnstructuredGrid");
    text = meshio__attribute(tag, end, "compressor", &length);
    vtu->zlib = text && meshio__same(text, length, "vtkzlibdatacompressor");
    if (text && length && !vtu->zlib)
        return meshio__fail(r, MESHIO_ERROR_UNSUPPORTED, tag,
                            "data of the compressor %.*s; only zlib's are read",
                            length < 40 ? (int)length : 40, (const char *)text);
    text = meshio__attribute(tag, end, "header_type", &length);
    vtu->wide = text && meshio__same(text, length, "uint64");
    text = meshio__attribute(tag, end, "byte_order", &length);
    if (text && meshio__same(text, length, "bigendian")) r->swap = !r->swap;
    return MESHIO_OK;
}

/* Reads the tag <Piece>, which has the numbers of points and cells. */
static meshio_result meshio__vtu_piece(meshio__reader *r, meshio__vtu *vtu,
                                       const unsigned char *tag, const unsigned char *end)
{
    if (vtu->pieces++)
        return meshio__fail(r, MESHIO_ERROR_UNSUPPORTED, tag, "more than one piece");
    MESHIO__TRY(meshio__attribute_int(r, tag, end, "numberofpoints", &vtu->points));
    MESHIO__TRY(meshio__attribute_int(r, tag, end, "numberofcells", &vtu->cells));
    if (vtu->zlib) return MESHIO_OK; /* the header of each array is checked instead */
    MESHIO__TRY(meshio__fits(r, vtu->points, 6, "points"));
    return meshio__fits(r, vtu->cells, 3, "cells");
}

/* The section that the tag with this name begins: 'p', 'c' and 'd' for <Points>, <Cells> and
 * <CellData>, 1 for one whose arrays are not read; 0: it begins none. */
static int meshio__vtu_section(const unsigned char *name, size_t length)
{
    return meshio__same(name, length, "<points")      ? 'p'
           : meshio__same(name, length, "<cells")     ? 'c'
           : meshio__same(name, length, "<celldata")  ? 'd'
           : meshio__same(name, length, "<pointdata") ? 1
           : meshio__same(name, length, "<fielddata") ? 1
                                                      : 0;
}

static meshio_result meshio__read_vtu(meshio__reader *r)
{
    meshio__vtu vtu;
    const unsigned char *p, *end, *text, *corners = NULL, *appended;
    size_t length;
    int section = 0, begun; /* 0: before <VTKFile> */
    memset(&vtu, 0, sizeof vtu);
    r->text = 1;
    r->swap = !meshio__little_endian();
    vtu.end = r->end;
    if (r->begin == r->end) return meshio__expected(r, "<VTKFile");
    MESHIO__TRY(meshio__vtu_find_appended(r, &vtu, &appended));
    for (p = r->begin; (p = (const unsigned char *)memchr(p, '<', (size_t)(r->end - p))) != NULL;
         p = end + 1) {
        if (p == appended) break;
        end = meshio__tag_end(p, r->end);
        r->p = p;
        if (!end) return meshio__fail(r, MESHIO_ERROR_TRUNCATED, p, "a tag that does not end");
        for (length = 1; p + length < end && !meshio__is_space(p[length]) && p[length] != '/';)
            length++;
        if (meshio__same(p, length, "<vtkfile")) {
            MESHIO__TRY(meshio__vtu_file(r, &vtu, p, end));
            section = 1;
        } else if (section == 0 && p[1] != '?' && p[1] != '!') {
            return meshio__fail(r, MESHIO_ERROR_FORMAT, p, "not a VTU file");
        } else if (meshio__same(p, length, "<piece")) {
            MESHIO__TRY(meshio__vtu_piece(r, &vtu, p, end));
        } else if ((begun = meshio__vtu_section(p, length)) != 0) {
            section = begun;
        } else if (section > 1 && meshio__same(p, length, "<dataarray")) {
            text = meshio__attribute(p, end, "name", &length);
            if (section == 'c' && text && meshio__same(text, length, "connectivity"))
                corners = p;
            else
                MESHIO__TRY(meshio__vtu_array(r, &vtu, section, p, end));
        }
    }
    if (section == 0) return meshio__fail(r, MESHIO_ERROR_FORMAT, r->begin, "not a VTU file");
    if (!vtu.pieces) return meshio__expected(r, "a <Piece>");
    if (vtu.points != (int64_t)r->mesh->num_vertices) return meshio__expected(r, "the points");
    MESHIO__TRY(meshio__vtu_corners(r, &vtu, corners));
    return meshio__cells_store(r);
}

/* ---- >>tetgen -------------------------------------------------------------------------------- */

/* Fails if the list of a file goes on after the count that it claims: with the next number, and at
 * least three more on its line. Anything else may follow. */
static meshio_result meshio__no_more_items(meshio__reader *r, const char *what, int64_t count,
                                           int64_t last)
{
    const unsigned char *where;
    int k;
    meshio__skip(r);
    where = r->p;
    if (count == 0 || meshio__number(r) != last + 1) return MESHIO_OK;
    for (k = 0; k < 3; k++) {
        if (!meshio__more_on_line(r)) return MESHIO_OK;
        meshio__pass_value(r);
    }
    return meshio__fail(r, MESHIO_ERROR_COUNT, where, "one more %s than the %lld claimed", what,
                        (long long)count);
}

/* Reads the list of nodes; *first becomes the number of the first one (0 or 1). */
static meshio_result meshio__tetgen_nodes(meshio__reader *r, int64_t *first)
{
    int64_t count, dimension = 3, attributes = 0, markers = 0, i, id, tag;
    double xyz[3], unused;
    int k, lines = 0; /* lines: the first node has a line */
    *first = 1;
    MESHIO__TRY(meshio__int(r, &count));
    if (meshio__more_on_line(r)) MESHIO__TRY(meshio__int(r, &dimension));
    if (meshio__more_on_line(r)) MESHIO__TRY(meshio__int(r, &attributes));
    if (meshio__more_on_line(r)) MESHIO__TRY(meshio__int(r, &markers));
    if (dimension != 3)
        return meshio__fail(r, MESHIO_ERROR_UNSUPPORTED, r->p, "dimension %lld, not 3",
                            (long long)dimension);
    MESHIO__TRY(meshio__fits(r, attributes, 2, "attributes"));
    MESHIO__TRY(meshio__fits(r, count, 8, "nodes"));
    for (i = 0; i < count; i++) {
        const unsigned char *where;
        meshio__skip(r);
        where = r->p;
        MESHIO__TRY(meshio__int(r, &id));
        if (i == 0) *first = id;
        if (id != *first + i || *first < 0 || *first > 1)
            return meshio__fail(r, MESHIO_ERROR_INDEX, where, "node %lld where %lld is due",
                                (long long)id, (long long)(i ? *first + i : 1));
        for (k = 0; k < 3; k++) {
            if (lines && !meshio__more_on_line(r) && r->p < r->end)
                return meshio__fail(r, MESHIO_ERROR_SYNTAX, where, "a node needs 3 coordinates");
            MESHIO__TRY(meshio__double(r, &xyz[k]));
        }
        for (k = 0; k < attributes; k++) MESHIO__TRY(meshio__double(r, &unused));
        tag = 0;
        if (markers) MESHIO__TRY(meshio__int_or_double(r, &tag));
        if (i == 0)
            lines = meshio__line_end(where, r->p) == r->p && !meshio__more_on_line(r);
        MESHIO__TRY(meshio__add_vertex(r, xyz, tag));
    }
    return MESHIO_OK;
}

static meshio_result meshio__read_node(meshio__reader *r)
{
    int64_t first, count;
    r->text = 1;
    r->comment = '#';
    MESHIO__TRY(meshio__tetgen_nodes(r, &first));
    count = (int64_t)r->mesh->num_vertices;
    return meshio__no_more_items(r, "node", count, first + count - 1);
}

/* Reads a polygon of n corners into r->polygon and appends it to the facet's loops. */
static meshio_result meshio__tetgen_polygon(meshio__reader *r, int64_t n, int64_t first,
                                            meshio__loops *loops)
{
    size_t i;
    if (n < 1)
        return meshio__fail(r, MESHIO_ERROR_COUNT, r->p, "a polygon of %lld corners", (long long)n);
    MESHIO__TRY(meshio__read_polygon_text(r, n, first));
    for (i = 0; i < r->polygon.num; i++)
        if (!meshio__push32(&loops->corners, r->polygon.data[i])) return meshio__no_memory(r);
    return meshio__push64(&loops->ends, loops->corners.num) ? MESHIO_OK : meshio__no_memory(r);
}

/* Reads a point in a hole or region. */
static meshio_result meshio__seed(meshio__reader *r, double xyz[3])
{
    int k;
    MESHIO__TRY(meshio__xyz(r, xyz));
    for (k = 0; k < 3; k++)
        if (xyz[k] - xyz[k] != 0)
            return meshio__fail(r, MESHIO_ERROR_SYNTAX, r->p,
                                "the point of a hole or region is not finite");
    return MESHIO_OK;
}

static meshio_result meshio__tetgen_facet_hole(meshio__reader *r, meshio__loops *loops)
{
    int64_t id;
    double xyz[3];
    int k;
    MESHIO__TRY(meshio__int(r, &id));
    MESHIO__TRY(meshio__seed(r, xyz));
    if (!meshio__reserve_doubles(&loops->holes, &loops->cap_holes, 3 * loops->num_holes + 3))
        return meshio__no_memory(r);
    for (k = 0; k < 3; k++) loops->holes[3 * loops->num_holes + (size_t)k] = xyz[k];
    loops->num_holes++;
    return MESHIO_OK;
}

/* Reads one facet. In .poly files its first line has the number of polygons, the number of holes
 * and the marker; in .smesh files a facet is one polygon, with the marker after its corners. */
static meshio_result meshio__tetgen_facet(meshio__reader *r, int poly, int markers, int64_t first,
                                          meshio__loops *loops)
{
    int64_t polygons = 1, holes = 0, tag = 0, n, i;
    const unsigned char *where;
    loops->corners.num = loops->ends.num = loops->num_holes = 0;
    meshio__skip(r);
    where = r->p;
    MESHIO__TRY(meshio__int(r, &polygons));
    if (poly) {
        if (meshio__more_on_line(r)) MESHIO__TRY(meshio__int(r, &holes));
        if (meshio__more_on_line(r)) MESHIO__TRY(meshio__int_or_double(r, &tag));
        MESHIO__TRY(meshio__fits(r, polygons, 2, "polygons in a facet"));
        MESHIO__TRY(meshio__fits(r, holes, 4, "holes in a facet"));
        for (i = 0; i < polygons; i++) {
            MESHIO__TRY(meshio__int(r, &n));
            MESHIO__TRY(meshio__tetgen_polygon(r, n, first, loops));
        }
        for (i = 0; i < holes; i++) MESHIO__TRY(meshio__tetgen_facet_hole(r, loops));
    } else {
        MESHIO__TRY(meshio__tetgen_polygon(r, polygons, first, loops));
        while (markers && meshio__more_on_line(r)) MESHIO__TRY(meshio__int_or_double(r, &tag));
    }
    return meshio__add_facet(r, where, loops, tag);
}

/* Parts 3 and 4 of the file: points in cavities; points in regions, each with an attribute and a
 * largest volume. */
static meshio_result meshio__tetgen_seeds(meshio__reader *r, int regions)
{
    meshio_mesh *m = r->mesh;
    int64_t count, id, i;
    int k, width = regions ? 5 : 3;
    double value[5];
    if (!meshio__skip(r)) return regions ? MESHIO_OK : meshio__expected(r, "the list of holes");
    MESHIO__TRY(meshio__int(r, &count));
    MESHIO__TRY(meshio__fits(r, count, 8, regions ? "regions" : "holes"));
    for (i = 0; i < count; i++) {
        double **array = regions ? &m->regions : &m->holes;
        size_t *cap = regions ? &r->cap_regions : &r->cap_holes;
        size_t *num = regions ? &m->num_regions : &m->num_holes;
        MESHIO__TRY(meshio__int(r, &id));
        MESHIO__TRY(meshio__seed(r, value));
        value[3] = 0;
        value[4] = -1;
        for (k = 3; k < width && meshio__more_on_line(r); k++)
            MESHIO__TRY(meshio__double(r, &value[k]));
        if (!meshio__reserve_doubles(array, cap, (size_t)width * (*num + 1)))
            return meshio__no_memory(r);
        memcpy(*array + (size_t)width * *num, value, (size_t)width * sizeof(double));
        ++*num;
    }
    return MESHIO_OK;
}

/* The nodes are in the file itself, or if it lists 0 nodes, they have been read from the .node file
 * beside it. */
static meshio_result meshio__read_poly(meshio__reader *r, int poly, int64_t first,
                                       meshio__loops *loops)
{
    int64_t count, markers = 0, i, own;
    size_t beside = r->mesh->num_vertices;
    r->text = 1;
    r->comment = '#';
    MESHIO__TRY(meshio__tetgen_nodes(r, &own));
    if (r->mesh->num_vertices == beside) {
        if (beside == 0)
            return meshio__fail(r, MESHIO_ERROR_COUNT, r->p,
                                "no nodes, here or in a .node file beside this one");
    } else {
        if (beside) return meshio__fail(r, MESHIO_ERROR_COUNT, r->p, "nodes here and beside");
        first = own;
    }
    MESHIO__TRY(meshio__int(r, &count));
    if (meshio__more_on_line(r)) MESHIO__TRY(meshio__int(r, &markers));
    MESHIO__TRY(meshio__fits(r, count, 4, "facets"));
    for (i = 0; i < count; i++)
        MESHIO__TRY(meshio__tetgen_facet(r, poly, markers != 0, first, loops));
    MESHIO__TRY(meshio__tetgen_seeds(r, 0));
    MESHIO__TRY(meshio__tetgen_seeds(r, 1));
    meshio__next_line(r);
    if (!meshio__skip(r) || !meshio__is_digit(*r->p)) return MESHIO_OK;
    return meshio__fail(r, MESHIO_ERROR_COUNT, r->p,
                        "the file goes on after its last list: a count is too small");
}

/* Tetrahedra of 4 or 10 nodes, with attributes; the first one is the tag. */
static meshio_result meshio__read_elements(meshio__reader *r, int64_t first)
{
    int64_t count, corners = 4, attributes = 0, i, id = 0, index, tag;
    uint32_t v[10];
    int k;
    r->text = 1;
    r->comment = '#';
    MESHIO__TRY(meshio__int(r, &count));
    if (meshio__more_on_line(r)) MESHIO__TRY(meshio__int(r, &corners));
    if (meshio__more_on_line(r)) MESHIO__TRY(meshio__int(r, &attributes));
    if (corners != 4 && corners != 10)
        return meshio__fail(r, MESHIO_ERROR_UNSUPPORTED, r->p, "elements of %lld corners",
                            (long long)corners);
    MESHIO__TRY(meshio__fits(r, attributes, 2, "attributes"));
    MESHIO__TRY(meshio__fits(r, count, 8, "elements"));
    for (i = 0; i < count; i++) {
        MESHIO__TRY(meshio__int(r, &id));
        for (k = 0; k < corners; k++) MESHIO__TRY(meshio__corner(r, first, &v[k]));
        tag = 0;
        for (k = 0; meshio__more_on_line(r); k++) {
            MESHIO__TRY(meshio__int_or_double(r, &index));
            if (k == 0) tag = index;
        }
        MESHIO__TRY(meshio__add_tet(r, v, tag));
        MESHIO__TRY(meshio__add_spare(r, v + 4, (size_t)corners - 4));
    }
    return meshio__no_more_items(r, "element", count, id);
}

/* Triangles, each followed by the nodes in the middle of its edges if it is quadratic, by a marker
 * if the file has markers, and by the elements at it if TetGen was asked for them. */
static meshio_result meshio__read_faces(meshio__reader *r, int64_t first, int quadratic)
{
    int64_t count, markers = 0, i, id = 0, index, values[6];
    int k, num, at = quadratic ? 3 : 0;
    r->text = 1;
    r->comment = '#';
    MESHIO__TRY(meshio__int(r, &count));
    if (meshio__more_on_line(r)) MESHIO__TRY(meshio__int(r, &markers));
    MESHIO__TRY(meshio__fits(r, count, 8, "faces"));
    for (i = 0; i < count; i++) {
        uint32_t v[3];
        MESHIO__TRY(meshio__int(r, &id));
        for (k = 0; k < 3; k++) MESHIO__TRY(meshio__corner(r, first, &v[k]));
        for (num = 0; meshio__more_on_line(r); num++) {
            MESHIO__TRY(meshio__int_or_double(r, &index));
            if (num < 6) values[num] = index;
        }
        index = markers && num > at ? values[at] : 0;
        MESHIO__TRY(meshio__add_triangle(r, v[0], v[1], v[2], index));
    }
    return meshio__no_more_items(r, "face", count, id);
}

/* ---- >>inp  Abaqus and CalculiX -------------------------------------------------------------- */

/* A card is a line that starts with a star: its keyword, and those of its parameters that are of
 * use here. Data lines follow it. */
typedef struct meshio__inp_card {
    /* word: the keyword; name: that of the set, surface, part or instance (ELSET, NAME); part: the
     * part or instance that the card refers to (PART, INSTANCE) */
    const unsigned char *word, *type, *name, *part;
    size_t word_length, type_length, name_length, part_length;
    int generate;
    int elsewhere; /* the data are in another file, or in coordinates that are not Cartesian */
} meshio__inp_card;

/* The file is read in three passes; this is the state that they share. */
enum { MESHIO__INP_NODES, MESHIO__INP_ELEMENTS, MESHIO__INP_SURFACES };
typedef struct meshio__inp {
    int pass;
    int64_t cards;    /* cards whose name ends in no number, counted in the first pass */
    int skip;         /* the assembly only refers to what its parts define: ignore most cards */
    int has_surfaces; /* or sections; else elements need not be found by their ids */
    int64_t part, parts;  /* the current part or instance, from 1, 0 outside; those begun so far */
    int64_t with_nodes;   /* parts and instances that have nodes */
    /* Of each part or instance: the hash of its name, its first vertex, its last vertex + 1, and a
     * fourth number. For one with nodes the latter counts its instances in the first pass, and is
     * its number among those with nodes, from 1, afterwards; for an instance without nodes it is
     * the part that it places, from 1; else 0. */
    meshio__u64s ranges;
    meshio__u64s tets; /* pairs (id in the file, tetrahedron); the latter has INP_PART added if it
                        * has no set, so that its tag is that of its part */
    meshio__u64s sets; /* of elements: hash of the name, first id, last id, step; sorted later */
    uint64_t named;    /* how many tetrahedra sets have been applied to so far */
} meshio__inp;

/* Each part numbers its nodes and elements on its own: an id here has the file's number in the
 * lowest INP_BITS bits, and the part above them. */
enum { MESHIO__INP_BITS = 42, MESHIO__INP_PARTS = 10000 };
#define MESHIO__INP_PART (UINT64_C(1) << 32)

/* Skips empty lines and comments. Returns whether the next line is a data line. */
static int meshio__inp_data(meshio__reader *r)
{
    while (r->p < r->end) {
        if (meshio__more_on_line(r) && !(r->p[0] == '*' && r->p[1] == '*')) return *r->p != '*';
        meshio__next_line(r);
    }
    return 0;
}

/* Skips what separates two values: blanks and a comma, and the end of the line if it comes after
 * the comma. Returns whether there is another value. */
static int meshio__inp_more(meshio__reader *r)
{
    int comma = meshio__more_on_line(r) && *r->p == ',';
    if (comma) r->p++;
    if (comma && !meshio__more_on_line(r)) meshio__next_line(r);
    return meshio__more_on_line(r);
}

/* Moves to the next line, unless the cursor is at a card already (after a comma at the end of the
 * last data line). */
static void meshio__inp_next(meshio__reader *r)
{
    if (*r->p != '*') meshio__next_line(r);
}

/* The text up to a comma, an equals sign or the end of the line, without blanks around it. */
static const unsigned char *meshio__inp_field(meshio__reader *r, size_t *length)
{
    const unsigned char *start, *stop;
    meshio__more_on_line(r);
    start = stop = r->p;
    for (; r->p < r->end && *r->p != ',' && *r->p != '=' && *r->p != '\n' && *r->p != '\r'; r->p++)
        if (!meshio__is_space(*r->p)) stop = r->p + 1;
    *length = (size_t)(stop - start);
    return start;
}

static void meshio__inp_read_card(meshio__reader *r, meshio__inp_card *card)
{
    memset(card, 0, sizeof *card);
    r->p++;
    card->word = meshio__inp_field(r, &card->word_length);
    while (*r->p == ',' && meshio__inp_more(r)) {
        size_t length, size = 0;
        const unsigned char *key = meshio__inp_field(r, &length), *value = NULL;
        if (*r->p == '=') {
            r->p++;
            value = meshio__inp_field(r, &size);
        }
        if (meshio__same(key, length, "input") ||
            (meshio__same(key, length, "system") && size && meshio__lower(*value) != 'r'))
            card->elsewhere = 1;
        if (meshio__same(key, length, "type")) {
            card->type = value;
            card->type_length = size;
        } else if (meshio__same(key, length, "generate")) {
            card->generate = 1;
        } else if (meshio__same(key, length, "part") || meshio__same(key, length, "instance")) {
            card->part = value;
            card->part_length = size;
        } else if (meshio__same(key, length, "elset") || meshio__same(key, length, "name")) {
            card->name = value;
            card->name_length = size;
        }
    }
    meshio__next_line(r);
}

static uint64_t meshio__inp_hash(const unsigned char *name, size_t length)
{
    uint64_t h = UINT64_C(0xcbf29ce484222325);
    size_t i;
    for (i = 0; i < length; i++)
        h = (h ^ (uint64_t)meshio__lower(name[i])) * UINT64_C(0x100000001b3);
    return h;
}

/* The tag that a card's name stands for: the number that it ends in, which is negative after _M; 0
 * if it does not fit. A name without a number has the number of the first card with this name,
 * counted in the first pass. Without a name: the number of the part, if several have nodes, else
 * 0. */
static meshio_result meshio__inp_tag(meshio__reader *r, meshio__inp *inp,
                                     const meshio__inp_card *card, int64_t *tag)
{
    const unsigned char *name = card->name;
    size_t n = card->name_length, at = n, k;
    uint64_t hash;
    *tag = inp->with_nodes > 1 && inp->part
               ? (int64_t)inp->ranges.data[4 * (size_t)inp->part - 1]
               : 0;
    if (n == 0) return MESHIO_OK;
    *tag = 0;
    while (at > 0 && meshio__is_digit(name[at - 1])) at--;
    for (k = at; k < n; k++)
        if (*tag <= -(int64_t)INT32_MIN) *tag = 10 * *tag + (name[k] - '0');
    if (at > 1 && at < n && meshio__lower(name[at - 1]) == 'm' && name[at - 2] == '_') *tag = -*tag;
    if (*tag > INT32_MAX || *tag < INT32_MIN) *tag = 0;
    if (at < n) return MESHIO_OK;
    hash = meshio__inp_hash(name, n);
    if (inp->pass == MESHIO__INP_NODES) {
        if (!meshio__push64(&r->entities, hash) ||
            !meshio__push64(&r->entities, (uint64_t)++inp->cards))
            return meshio__no_memory(r);
    } else {
        k = meshio__pair_find(&r->entities, hash);
        if (k < r->entities.num / 2) *tag = (int64_t)r->entities.data[2 * k + 1];
    }
    return MESHIO_OK;
}

static meshio_result meshio__inp_id(meshio__reader *r, const meshio__inp *inp, int64_t *id)
{
    MESHIO__TRY(meshio__int(r, id));
    if (*id < 0 || *id >> MESHIO__INP_BITS)
        return meshio__fail(r, MESHIO_ERROR_INDEX, r->p, "the number %lld of a node or element",
                            (long long)*id);
    if (inp->part > 1) *id |= (inp->part - 1) << MESHIO__INP_BITS;
    return MESHIO_OK;
}

static meshio_result meshio__inp_nodes(meshio__reader *r, const meshio__inp *inp)
{
    for (; meshio__inp_data(r); meshio__inp_next(r)) {
        double xyz[3] = {0, 0, 0};
        int64_t id;
        int k;
        MESHIO__TRY(meshio__inp_id(r, inp, &id));
        for (k = 0; k < 3 && meshio__inp_more(r) && *r->p != '*'; k++)
            if (*r->p != ',') MESHIO__TRY(meshio__double(r, &xyz[k])); /* an empty field is 0 */
        MESHIO__TRY(meshio__id_add(r, id, r->mesh->num_vertices));
        MESHIO__TRY(meshio__add_vertex(r, xyz, 0));
    }
    return MESHIO_OK;
}

enum { MESHIO__INP_SOLID = 100 }; /* the type of a solid that is not kept */

/* Returns the number of corners of an element type, negative for triangles and quadrangles, or
 * INP_SOLID, or 0 for another kind; *nodes becomes the number of its nodes. The name of a type is
 * that of its family, a number of nodes, and letters that do not matter here. */
static int meshio__inp_type(const meshio__inp_card *card, int *nodes)
{
    static const struct {
        const char *family;
        char kind; /* f: flat, s: solid, l: line, b: beam */
    } types[] = {{"c3d", 's'},   {"dc3d", 's'}, {"ac3d", 's'}, {"stri", 'f'}, {"sfm3d", 'f'},
                 {"s", 'f'},     {"cps", 'f'},  {"cpe", 'f'},  {"cax", 'f'},  {"m3d", 'f'},
                 {"r3d", 'f'},   {"ds", 'f'},   {"t3d", 'l'},  {"t2d", 'l'},  {"b3", 'b'},
                 {"b2", 'b'}};
    size_t i, k;
    for (i = 0; i < sizeof types / sizeof types[0]; i++) {
        int n = 0;
        k = strlen(types[i].family);
        if (card->type_length <= k || !meshio__same(card->type, k, types[i].family)) continue;
        if (!meshio__is_digit(card->type[k])) continue;
        for (; k < card->type_length && meshio__is_digit(card->type[k]) && n < 100; k++)
            n = 10 * n + (card->type[k] - '0');
        if (n == 65) n = 6; /* STRI65 */
        if (types[i].kind == 'b') n = n == 2 ? 3 : n == 1 || n == 3 ? 2 : 0;
        *nodes = n;
        if (types[i].kind == 's') return n == 4 || n == 10 ? 4 : MESHIO__INP_SOLID;
        if (types[i].kind != 'f') return n == 2 || n == 3 ? 2 : 0;
        return n == 3 || n == 6 ? -3 : n == 4 || n == 8 || n == 9 ? -4 : 0;
    }
    return 0;
}

/* The key of a set: its name's hash and its part, as each part has its own sets. */
static uint64_t meshio__inp_set(const meshio__inp *inp, const unsigned char *name, size_t length)
{
    return meshio__inp_hash(name, length) + (uint64_t)inp->part * UINT64_C(0x9E3779B97F4A7C15);
}

/* Adds the elements first, first + step .. last to a set. 0 if memory runs out. */
static int meshio__inp_set_add(meshio__inp *inp, uint64_t set, int64_t first, int64_t last,
                               int64_t step)
{
    size_t n = inp->sets.num;
    uint64_t *before = n ? inp->sets.data + n - 4 : NULL;
    if (n && before[0] == set && before[3] == 1 && step == 1 && before[2] + 1 == (uint64_t)first) {
        before[2] = (uint64_t)last;
        return 1;
    }
    return meshio__push64(&inp->sets, set) && meshio__push64(&inp->sets, (uint64_t)first) &&
           meshio__push64(&inp->sets, (uint64_t)last) && meshio__push64(&inp->sets, (uint64_t)step);
}

/* The part or instance with the elements of the instance that the card refers to; 0: none. */
static int64_t meshio__inp_part_of(const meshio__inp *inp, const meshio__inp_card *card)
{
    uint64_t hash = meshio__inp_hash(card->part, card->part_length);
    size_t i;
    for (i = 0; i < inp->ranges.num; i += 4) {
        const uint64_t *range = inp->ranges.data + i;
        if (range[0] != hash) continue;
        if (range[1] < range[2]) return (int64_t)(i / 4 + 1);
        if (range[3]) return (int64_t)range[3];
    }
    return 0;
}

/* *ELSET: ids of elements, or with GENERATE first, last, step. Names of other sets are skipped. */
static meshio_result meshio__inp_elset(meshio__reader *r, meshio__inp *inp,
                                       const meshio__inp_card *card)
{
    uint64_t set = meshio__inp_set(inp, card->name, card->name_length);
    int64_t part = inp->part, id, last, step;
    if (card->part && !(inp->part = meshio__inp_part_of(inp, card))) {
        inp->part = part;
        return MESHIO_OK;
    }
    for (; meshio__inp_data(r); meshio__inp_next(r))
        do {
            const unsigned char *p = r->p;
            size_t unused;
            while (meshio__is_digit(*p)) p++;
            if (p == r->p || !meshio__is_end(*p)) {
                meshio__inp_field(r, &unused);
                if (*r->p == '=') r->p++;
                continue;
            }
            MESHIO__TRY(meshio__inp_id(r, inp, &id));
            last = id;
            step = 1;
            if (card->generate) {
                if (!meshio__inp_more(r)) return meshio__expected(r, "the set's last element");
                MESHIO__TRY(meshio__inp_id(r, inp, &last));
                if (meshio__more_on_line(r) && *r->p == ',') r->p++;
                if (meshio__more_on_line(r)) MESHIO__TRY(meshio__int(r, &step));
                if (step < 1) return meshio__fail(r, MESHIO_ERROR_COUNT, p, "a step below 1");
            }
            if (!meshio__inp_set_add(inp, set, id, last, step)) return meshio__no_memory(r);
        } while (meshio__inp_more(r) && *r->p != '*');
    inp->part = part;
    return MESHIO_OK;
}

/* For the tetrahedra first, first + step .. last: adds their facet `side`, 0 .. 3, as a triangle
 * with this tag; if side is -1, those whose tag is 0 or the number of their part get this one. */
static meshio_result meshio__inp_apply(meshio__reader *r, meshio__inp *inp, uint64_t first,
                                       uint64_t last, uint64_t step, int side, int64_t tag)
{
    static const unsigned char corners[4][3] = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};
    size_t k = meshio__records_from(&inp->tets, 2, first), n = inp->tets.num / 2;
    for (; k < n && inp->tets.data[2 * k] <= last; k++) {
        uint64_t *tet = &inp->tets.data[2 * k + 1];
        size_t t = (size_t)(*tet & (MESHIO__INP_PART - 1));
        const uint32_t *v = r->mesh->tets + 4 * t;
        if (++inp->named > 1000 + 64 * (uint64_t)n) /* bounds the work; far beyond real files */
            return meshio__fail(r, MESHIO_ERROR_TOO_LARGE, r->p,
                                "surfaces and sections name each element more than 64 times");
        if ((inp->tets.data[2 * k] - first) % step) continue;
        if (side >= 0)
            MESHIO__TRY(meshio__add_triangle(r, v[corners[side][0]], v[corners[side][1]],
                                             v[corners[side][2]], tag));
        else if (r->mesh->tet_tags[t] == 0 || t != *tet) {
            r->mesh->tet_tags[t] = (int32_t)tag;
            *tet = t;
        }
    }
    return MESHIO_OK;
}

/* The same for all elements of a set. */
static meshio_result meshio__inp_apply_set(meshio__reader *r, meshio__inp *inp, uint64_t set,
                                           int side, int64_t tag)
{
    size_t i = 4 * meshio__records_from(&inp->sets, 4, set);
    for (; i < inp->sets.num && inp->sets.data[i] == set; i += 4)
        MESHIO__TRY(meshio__inp_apply(r, inp, inp->sets.data[i + 1], inp->sets.data[i + 2],
                                      inp->sets.data[i + 3], side, tag));
    return MESHIO_OK;
}

/* Counts elements of a kind that is not kept. */
static void meshio__inp_skip_elements(meshio__reader *r, int solid)
{
    while (meshio__inp_data(r)) {
        r->mesh->num_other++;
        r->mesh->num_solids += (size_t)solid;
        while (meshio__inp_more(r) && *r->p != '*')
            while (r->p < r->end && *r->p != ',' && !meshio__is_space(*r->p)) r->p++;
        meshio__inp_next(r);
    }
}

static meshio_result meshio__inp_elements(meshio__reader *r, meshio__inp *inp,
                                          const meshio__inp_card *card)
{
    int nodes = 0, type = meshio__inp_type(card, &nodes), k, corners;
    uint64_t by_part = card->name_length ? 0 : MESHIO__INP_PART;
    int64_t tag, id, node;
    uint32_t v[10];
    MESHIO__TRY(meshio__inp_tag(r, inp, card, &tag));
    if (type == 0 || type == MESHIO__INP_SOLID) {
        meshio__inp_skip_elements(r, type != 0);
        return MESHIO_OK;
    }
    for (; meshio__inp_data(r); meshio__next_line(r)) {
        MESHIO__TRY(meshio__inp_id(r, inp, &id));
        for (k = 0; k < nodes; k++) {
            const unsigned char *where;
            if (!meshio__inp_more(r))
                return meshio__fail(r, MESHIO_ERROR_SYNTAX, r->p,
                                    "an element of %d nodes instead of %d", k, nodes);
            where = r->p;
            MESHIO__TRY(meshio__inp_id(r, inp, &node));
            MESHIO__TRY(meshio__id_find(r, where, node, &v[k]));
        }
        if (type == 2 && nodes == 3) { /* the second node of a line is the one in the middle */
            const uint32_t middle = v[1];
            v[1] = v[2];
            v[2] = middle;
        }
        corners = type < 0 ? -type : type;
        MESHIO__TRY(meshio__add_spare(r, v + corners, (size_t)(nodes - corners)));
        if (type < 0) {
            MESHIO__TRY(meshio__add_polygon(r, v, (size_t)-type, tag));
        } else if (type == 2) {
            MESHIO__TRY(meshio__add_edge(r, v, tag));
        } else {
            if (inp->has_surfaces &&
                (!meshio__push64(&inp->tets, (uint64_t)id) ||
                 !meshio__push64(&inp->tets, r->mesh->num_tets | by_part) ||
                 (card->name_length &&
                  !meshio__inp_set_add(
                      inp, meshio__inp_set(inp, card->name, card->name_length), id, id, 1))))
                return meshio__no_memory(r);
            MESHIO__TRY(meshio__add_tet(r, v, tag));
        }
    }
    return MESHIO_OK;
}

/* Fails for cards that are not supported, but without which the mesh would be wrong. */
static meshio_result meshio__inp_check(meshio__reader *r, const meshio__inp_card *card,
                                       const unsigned char *where)
{
    static const char *const making[] = {"ngen", "nfill",  "ncopy", "nmap",
                                         "elgen", "elcopy", "system", "submodel instance"};
    size_t i;
    if (meshio__same(card->word, card->word_length, "include"))
        return meshio__fail(r, MESHIO_ERROR_UNSUPPORTED, where,
                            "*INCLUDE: files within the file are not read");
    for (i = 0; i < sizeof making / sizeof making[0]; i++)
        if (meshio__same(card->word, card->word_length, making[i]))
            return meshio__fail(r, MESHIO_ERROR_UNSUPPORTED, where,
                                "*%s: nodes and elements that are made or moved by a rule are not "
                                "read",
                                making[i]);
    if (card->elsewhere && (meshio__same(card->word, card->word_length, "node") ||
                            meshio__same(card->word, card->word_length, "element")))
        return meshio__fail(r, MESHIO_ERROR_UNSUPPORTED, where,
                            "only nodes and elements in this file, and in x, y, z, are read");
    return MESHIO_OK;
}

/* Moves vertices to the place of an instance: translation by place[0 .. 2], then rotation by
 * place[9] degrees about the line from point place[3 .. 5] to point place[6 .. 8]. */
static void meshio__inp_move(meshio_mesh *m, size_t first, size_t end, const double place[10])
{
    double axis[3], length = 0, angle = place[9] * 0.017453292519943295;
    double c = cos(angle), s = sin(angle);
    int k;
    for (k = 0; k < 3; k++) axis[k] = place[6 + k] - place[3 + k];
    for (k = 0; k < 3; k++) length += axis[k] * axis[k];
    for (k = 0; k < 3; k++) axis[k] = length > 0 ? axis[k] / sqrt(length) : 0;
    for (; first < end; first++) {
        double *x = m->xyz + 3 * first, v[3], along = 0;
        for (k = 0; k < 3; k++) x[k] += place[k];
        if (angle == 0) continue;
        for (k = 0; k < 3; k++) v[k] = x[k] - place[3 + k];
        for (k = 0; k < 3; k++) along += axis[k] * v[k];
        for (k = 0; k < 3; k++)
            x[k] = place[3 + k] + c * v[k] + (1 - c) * along * axis[k] +
                   s * (axis[(k + 1) % 3] * v[(k + 2) % 3] - axis[(k + 2) % 3] * v[(k + 1) % 3]);
    }
}

/* Reads the data of an instance: its place, where it moves the vertices of its part. */
static meshio_result meshio__inp_instance(meshio__reader *r, meshio__inp *inp,
                                          const meshio__inp_card *card, const unsigned char *where)
{
    double place[10] = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0};
    uint64_t hash = meshio__inp_hash(card->part, card->part_length), *range;
    size_t i, k;
    for (i = 0; i < 10 && meshio__inp_data(r); i = i < 3 ? 3 : 10) { /* a line of 3, one of 7 */
        for (k = i; k < (i < 3 ? 3 : 10) && (k == i || meshio__inp_more(r)) && *r->p != '*'; k++)
            MESHIO__TRY(meshio__double(r, &place[k]));
        meshio__inp_next(r);
    }
    if (inp->pass != MESHIO__INP_NODES) return MESHIO_OK;
    for (i = 0; i < inp->ranges.num; i += 4) {
        range = inp->ranges.data + i;
        if (range[0] != hash || range[1] == range[2]) continue;
        if (range[3]++)
            return meshio__fail(r, MESHIO_ERROR_UNSUPPORTED, where,
                                "a second instance of a part: parts in several places are not "
                                "read");
        meshio__inp_move(r->mesh, (size_t)range[1], (size_t)range[2], place);
        inp->ranges.data[4 * (size_t)inp->part - 1] = i / 4 + 1;
    }
    return MESHIO_OK;
}

static void meshio__inp_end_part(const meshio__reader *r, meshio__inp *inp)
{
    if (inp->pass == MESHIO__INP_NODES && inp->part)
        inp->ranges.data[4 * (size_t)inp->part - 2] = r->mesh->num_vertices;
    inp->part = 0;
}

/* Begins a part, or an instance (which may have nodes of its own). It has its own ids. */
static meshio_result meshio__inp_part(meshio__reader *r, meshio__inp *inp,
                                      const meshio__inp_card *card, const unsigned char *where)
{
    uint64_t n = r->mesh->num_vertices;
    meshio__inp_end_part(r, inp);
    if (inp->parts == MESHIO__INP_PARTS)
        return meshio__fail(r, MESHIO_ERROR_TOO_LARGE, where, "more than %d parts",
                            (int)MESHIO__INP_PARTS);
    inp->part = ++inp->parts;
    if (inp->pass == MESHIO__INP_NODES &&
        (!meshio__push64(&inp->ranges, meshio__inp_hash(card->name, card->name_length)) ||
         !meshio__push64(&inp->ranges, n) || !meshio__push64(&inp->ranges, n) ||
         !meshio__push64(&inp->ranges, 0)))
        return meshio__no_memory(r);
    return MESHIO_OK;
}

/* A surface of facets of tetrahedra: each line names an element (not in an assembly) or a set, and
 * a facet, S1 .. S4. Other lines, and elements of other kinds, are skipped. */
static meshio_result meshio__inp_surface(meshio__reader *r, meshio__inp *inp,
                                         const meshio__inp_card *card, int assembly)
{
    int64_t tag, id;
    MESHIO__TRY(meshio__inp_tag(r, inp, card, &tag));
    if (card->type_length && !meshio__same(card->type, card->type_length, "element"))
        return MESHIO_OK;
    for (; meshio__inp_data(r); meshio__inp_next(r)) {
        const unsigned char *p = r->p, *name;
        size_t length;
        uint64_t set;
        while (meshio__is_digit(*p)) p++;
        set = 0;
        id = -1;
        if (p > r->p && meshio__is_end(*p)) {
            if (assembly) continue;
            MESHIO__TRY(meshio__inp_id(r, inp, &id));
        } else {
            name = meshio__inp_field(r, &length);
            set = meshio__inp_set(inp, name, length);
        }
        if (!meshio__inp_more(r) || meshio__lower(*r->p) != 's') continue;
        if (r->p[1] < '1' || r->p[1] > '4') continue;
        if (id >= 0)
            MESHIO__TRY(meshio__inp_apply(r, inp, (uint64_t)id, (uint64_t)id, 1, r->p[1] - '1',
                                          tag));
        else
            MESHIO__TRY(meshio__inp_apply_set(r, inp, set, r->p[1] - '1', tag));
    }
    return MESHIO_OK;
}

/* *SOLID SECTION: the elements of its set are of one material; those without a set of their own, or
 * whose tag is 0, get a tag. */
static meshio_result meshio__inp_section(meshio__reader *r, meshio__inp *inp,
                                         const meshio__inp_card *card)
{
    int64_t tag;
    MESHIO__TRY(meshio__inp_tag(r, inp, card, &tag));
    if (inp->pass != MESHIO__INP_SURFACES || card->name_length == 0) return MESHIO_OK;
    return meshio__inp_apply_set(r, inp, meshio__inp_set(inp, card->name, card->name_length), -1,
                                 tag);
}

static meshio_result meshio__inp_one_card(meshio__reader *r, meshio__inp *inp, int *ignored)
{
    meshio__inp_card card;
    const unsigned char *where = r->p, *word;
    size_t length;
    int64_t unused;
    int elements, surface;
    meshio__inp_read_card(r, &card);
    word = card.word;
    length = card.word_length;
    MESHIO__TRY(meshio__inp_check(r, &card, where));
    if (meshio__same(word, length, "assembly")) {
        if (inp->pass == MESHIO__INP_NODES) inp->skip = r->mesh->num_vertices > 0;
        *ignored = inp->skip;
    }
    if (meshio__same(word, length, "end assembly")) *ignored = 0;
    if (meshio__same(word, length, "part")) return meshio__inp_part(r, inp, &card, where);
    if (meshio__same(word, length, "instance")) {
        *ignored = 0;
        MESHIO__TRY(meshio__inp_part(r, inp, &card, where));
        return meshio__inp_instance(r, inp, &card, where);
    }
    if (meshio__same(word, length, "end instance"))
        *ignored = inp->skip = r->mesh->num_vertices > 0;
    if (meshio__same(word, length, "end instance") || meshio__same(word, length, "end part"))
        meshio__inp_end_part(r, inp);
    surface = meshio__same(word, length, "surface");
    if (inp->pass == MESHIO__INP_ELEMENTS && meshio__same(word, length, "elset"))
        return meshio__inp_elset(r, inp, &card);
    if (*ignored && !surface) return MESHIO_OK;
    elements = meshio__same(word, length, "element");
    if (meshio__same(word, length, "solid section")) {
        inp->has_surfaces = 1;
        return meshio__inp_section(r, inp, &card);
    }
    switch (inp->pass) {
    case MESHIO__INP_NODES:
        if (meshio__same(word, length, "node")) return meshio__inp_nodes(r, inp);
        inp->has_surfaces |= surface;
        return elements || surface ? meshio__inp_tag(r, inp, &card, &unused) : MESHIO_OK;
    case MESHIO__INP_ELEMENTS: return elements ? meshio__inp_elements(r, inp, &card) : MESHIO_OK;
    default: return surface ? meshio__inp_surface(r, inp, &card, *ignored) : MESHIO_OK;
    }
}

static meshio_result meshio__inp_passes(meshio__reader *r, meshio__inp *inp)
{
    const unsigned char *start = r->p;
    size_t k;
    for (inp->pass = MESHIO__INP_NODES; inp->pass <= MESHIO__INP_SURFACES; inp->pass++) {
        int ignored = 0;
        inp->part = inp->parts = 0;
        r->p = start;
        while (r->p < r->end) {
            if (meshio__inp_data(r)) meshio__next_line(r);
            else if (r->p < r->end) MESHIO__TRY(meshio__inp_one_card(r, inp, &ignored));
        }
        meshio__inp_end_part(r, inp);
        if (inp->pass == MESHIO__INP_NODES) {
            for (k = 0; k < inp->ranges.num; k += 4) {
                if (inp->ranges.data[k + 2] > inp->ranges.data[k + 1])
                    inp->ranges.data[k + 3] = (uint64_t)++inp->with_nodes;
            }
            MESHIO__TRY(meshio__ids_close(r));
            if (r->entities.num)
                qsort(r->entities.data, r->entities.num / 2, 16, meshio__compare_ids);
        } else if (inp->pass == MESHIO__INP_ELEMENTS) {
            if (inp->tets.num) qsort(inp->tets.data, inp->tets.num / 2, 16, meshio__compare_ids);
            if (inp->sets.num) qsort(inp->sets.data, inp->sets.num / 4, 32, meshio__compare_ids);
        }
    }
    return MESHIO_OK;
}

static meshio_result meshio__read_inp(meshio__reader *r)
{
    meshio__inp inp;
    meshio_result result;
    memset(&inp, 0, sizeof inp);
    r->text = 1;
    r->id_bits = MESHIO__INP_BITS;
    result = meshio__inp_passes(r, &inp);
    MESHIO_FREE(inp.tets.data);
    MESHIO_FREE(inp.ranges.data);
    MESHIO_FREE(inp.sets.data);
    if (result == MESHIO_OK && r->mesh->num_vertices == 0)
        return meshio__fail(r, MESHIO_ERROR_FORMAT, r->begin, "no nodes in this file");
    return result;
}

/* ---- >>points -------------------------------------------------------------------------------- */

/* One point on each line, of which further columns are ignored. If the first line has one number
 * only, it is the number of points. */
static meshio_result meshio__read_xyz(meshio__reader *r)
{
    int64_t claimed = -1;
    double xyz[3];
    int k, first = 1;
    r->text = 1;
    r->comment = '#';
    for (; r->p < r->end; meshio__next_line(r)) {
        const unsigned char *line;
        if (!meshio__more_on_line(r)) continue;
        line = r->p;
        MESHIO__TRY(meshio__double(r, &xyz[0]));
        if (!meshio__more_on_line(r) && first) {
            r->p = line;
            MESHIO__TRY(meshio__int(r, &claimed));
            MESHIO__TRY(meshio__fits(r, claimed, 6, "points"));
            first = 0;
            continue;
        }
        first = 0;
        for (k = 1; k < 3; k++) {
            if (!meshio__more_on_line(r))
                return meshio__fail(r, MESHIO_ERROR_SYNTAX, line, "a point needs 3 numbers");
            MESHIO__TRY(meshio__double(r, &xyz[k]));
        }
        MESHIO__TRY(meshio__add_vertex(r, xyz, 0));
    }
    if (claimed >= 0 && (uint64_t)claimed != r->mesh->num_vertices)
        return meshio__fail(r, MESHIO_ERROR_COUNT, r->p, "%llu points where %lld were claimed",
                            (unsigned long long)r->mesh->num_vertices, (long long)claimed);
    return MESHIO_OK;
}

static meshio_result meshio__read_bin(meshio__reader *r)
{
    size_t size = (size_t)(r->end - r->begin), i;
    double xyz[3];
    int k;
    r->swap = !meshio__little_endian();
    if (size % 24 != 0)
        return meshio__fail(r, MESHIO_ERROR_TRUNCATED, r->end,
                            "%llu bytes are not a whole number of points of 24",
                            (unsigned long long)size);
    for (i = 0; i < size / 24; i++) {
        for (k = 0; k < 3; k++) MESHIO__TRY(meshio__f64(r, &xyz[k]));
        MESHIO__TRY(meshio__add_vertex(r, xyz, 0));
    }
    return MESHIO_OK;
}

/* ---- >>sizes --------------------------------------------------------------------------------- */

/* Reads how many values there are, which must be as many as the mesh has vertices. */
static meshio_result meshio__sizes_count(meshio__reader *r, size_t wanted)
{
    const unsigned char *where;
    int64_t count;
    meshio__skip(r);
    where = r->p;
    MESHIO__TRY(meshio__int(r, &count));
    if (count >= 0 && (uint64_t)count == wanted) return MESHIO_OK;
    return meshio__fail(r, MESHIO_ERROR_COUNT, where, "%lld values for a mesh of %llu vertices",
                        (long long)count, (unsigned long long)wanted);
}

/* Reads up to the values of a .sol file. */
static meshio_result meshio__sol_header(meshio__reader *r, size_t wanted)
{
    const unsigned char *where;
    int64_t version, dimension, fields, type = 1;
    MESHIO__TRY(meshio__expect(r, "meshversionformatted"));
    MESHIO__TRY(meshio__int(r, &version));
    MESHIO__TRY(meshio__expect(r, "dimension"));
    MESHIO__TRY(meshio__int(r, &dimension));
    if (dimension != 3)
        return meshio__fail(r, MESHIO_ERROR_UNSUPPORTED, r->p, "only Dimension 3 is read");
    MESHIO__TRY(meshio__expect(r, "solatvertices"));
    MESHIO__TRY(meshio__sizes_count(r, wanted));
    meshio__skip(r);
    where = r->p;
    MESHIO__TRY(meshio__int(r, &fields));
    if (fields == 1) MESHIO__TRY(meshio__int(r, &type));
    if (fields == 1 && type == 1) return MESHIO_OK;
    return meshio__fail(r, MESHIO_ERROR_UNSUPPORTED, where,
                        "not one scalar a vertex; vectors and tensors are not read");
}

/* Reads up to the values of a .mtr file. */
static meshio_result meshio__mtr_header(meshio__reader *r, size_t wanted)
{
    const unsigned char *where;
    int64_t numbers;
    MESHIO__TRY(meshio__sizes_count(r, wanted));
    meshio__skip(r);
    where = r->p;
    MESHIO__TRY(meshio__int(r, &numbers));
    if (numbers == 1) return MESHIO_OK;
    return meshio__fail(r, MESHIO_ERROR_UNSUPPORTED, where,
                        "%lld numbers a vertex; one is needed, tensors are not read",
                        (long long)numbers);
}

static meshio_result meshio__read_sizes(meshio__reader *r, int sol, double *values, size_t count)
{
    size_t i, length;
    const unsigned char *word;
    r->text = 1;
    r->comment = '#';
    MESHIO__TRY(sol ? meshio__sol_header(r, count) : meshio__mtr_header(r, count));
    for (i = 0; i < count; i++) MESHIO__TRY(meshio__double(r, &values[i]));
    word = meshio__word(r, &length);
    if (length == 0 || (sol && meshio__same(word, length, "end"))) return MESHIO_OK;
    r->p = word;
    return meshio__expected(r, "the end of the file");
}

/* ---- >>output  a buffered file that remembers its first error -------------------------------- */

typedef struct meshio__writer {
    FILE *file;
    char path[1024], part[1040]; /* the final name, and the name until the file is complete */
    int direct;                  /* a device or pipe: written under its own name */
    int failed, error;           /* error: errno of the first failure */
    int threads;
    uint64_t offset;
    size_t used;
    char buffer[1 << 16];
} meshio__writer;

static void meshio__flush(meshio__writer *w)
{
    if (!w->failed && w->used && fwrite(w->buffer, 1, w->used, w->file) != w->used) {
        w->failed = 1;
        w->error = errno;
    }
    w->offset += w->used;
    w->used = 0;
}

static void meshio__put(meshio__writer *w, const void *bytes, size_t size)
{
    const char *p = (const char *)bytes;
    while (size) {
        size_t n = sizeof w->buffer - w->used;
        if (n > size) n = size;
        memcpy(w->buffer + w->used, p, n);
        w->used += n;
        p += n;
        size -= n;
        if (w->used == sizeof w->buffer) meshio__flush(w);
    }
}

static void meshio__puts(meshio__writer *w, const char *text)
{
    meshio__put(w, text, strlen(text));
}

static void meshio__printf(meshio__writer *w, const char *format, ...) MESHIO__PRINTF(2, 3);
static void meshio__printf(meshio__writer *w, const char *format, ...)
{
    char text[512];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    meshio__puts(w, text);
}

/* Room in the buffer for this many bytes, which must fit in it. The caller writes there and raises
 * w->used. */
static char *meshio__room(meshio__writer *w, size_t bytes)
{
    if (sizeof w->buffer - w->used < bytes) meshio__flush(w);
    return w->buffer + w->used;
}

static const char meshio__two_digits[] =
    "0001020304050607080910111213141516171819202122232425262728293031323334353637383940414243444546"
    "4748495051525354555657585960616263646566676869707172737475767778798081828384858687888990919293"
    "949596979899";

static int meshio__num_digits(uint64_t v)
{
    int n = 1;
    for (; v >= 10000; v /= 10000) n += 4;
    return n + (v >= 10) + (v >= 100) + (v >= 1000);
}

/* An integer and the character after it. */
static void meshio__put_int(meshio__writer *w, int64_t value, char after)
{
    char *to = meshio__room(w, 24), *p;
    uint64_t v = value < 0 ? 0 - (uint64_t)value : (uint64_t)value;
    if (value < 0) *to++ = '-';
    p = to += meshio__num_digits(v);
    for (; v >= 100; v /= 100) memcpy(p -= 2, meshio__two_digits + 2 * (v % 100), 2);
    if (v >= 10) memcpy(p - 2, meshio__two_digits + 2 * v, 2);
    else p[-1] = (char)('0' + v);
    *to++ = after;
    w->used = (size_t)(to - w->buffer);
}

/* The product a * b of 128 bits: returns the upper 64 bits; *low becomes the lower ones. */
static uint64_t meshio__multiply(uint64_t a, uint64_t b, uint64_t *low)
{
    const uint64_t half = UINT64_C(0xffffffff);
    uint64_t a0 = a & half, a1 = a >> 32, b0 = b & half, b1 = b >> 32;
    uint64_t mid = (a0 * b0 >> 32) + (a0 * b1 & half) + (a1 * b0 & half);
    *low = mid << 32 | (a0 * b0 & half);
    return a1 * b1 + (a0 * b1 >> 32) + (a1 * b0 >> 32) + (mid >> 32);
}

static const double meshio__power[] = {1e0, 1e1, 1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                       1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15};

/* The first 17 decimal digits of a, as an integer, rounded to nearest, ties to even; *place becomes
 * the decimal exponent of the first digit. With a = m 2^-s the integer is m 10^k / 2^s, whose
 * numerator has at most 120 bits and is computed exactly. Returns 0 if a is outside the range for
 * which this works, 1e-4 .. 1e15, or the integer does not have 17 digits. */
static uint64_t meshio__digits(double a, int *place)
{
    uint64_t bits, low, high, digits, rest, below = 0, half;
    int d = 0, s, k;
    if (!(a >= 1e-4 && a < 1e15)) return 0;
    while (a >= meshio__power[d + 1]) d++;
    if (a < 1) d = a < 1e-3 ? -4 : a < 1e-2 ? -3 : a < 1e-1 ? -2 : -1;
    memcpy(&bits, &a, 8);
    s = 1075 - (int)(bits >> 52);
    bits = (bits & ((UINT64_C(1) << 52) - 1)) | UINT64_C(1) << 52;
    for (k = 16 - d, high = 1; k > 19; k--) bits *= 10;
    for (; k > 0; k--) high *= 10;
    high = meshio__multiply(bits, high, &low);
    if (s < 64) {
        digits = high << (64 - s) | low >> s;
        rest = low & ((UINT64_C(1) << s) - 1);
        half = UINT64_C(1) << (s - 1);
    } else {
        digits = s == 64 ? high : high >> (s - 64);
        rest = s == 64 ? low : high & ((UINT64_C(1) << (s - 64)) - 1);
        half = UINT64_C(1) << (s == 64 ? 63 : s - 65);
        below = s == 64 ? 0 : low;
    }
    if (rest > half || (rest == half && (below || (digits & 1)))) digits++;
    *place = d;
    return digits < UINT64_C(10000000000000000) || digits >= UINT64_C(100000000000000000) ? 0
                                                                                          : digits;
}

/* Writes what printf("%.17g") does, several times as fast for numbers of the usual size. Returns
 * the length. */
static int meshio__format_double(char text[40], double value)
{
    char digit[17];
    int place, n = 0, i, last = 17;
    uint64_t digits = meshio__digits(value < 0 ? -value : value, &place);
    uint32_t part;
    if (digits == 0) return snprintf(text, 40, "%.17g", value);
    part = (uint32_t)(digits % 100000000);
    for (i = 15; i > 8; i -= 2, part /= 100)
        memcpy(digit + i, meshio__two_digits + 2 * (part % 100), 2);
    part = (uint32_t)(digits / 100000000);
    for (; i > 0; i -= 2, part /= 100)
        memcpy(digit + i, meshio__two_digits + 2 * (part % 100), 2);
    digit[0] = (char)('0' + part);
    while (digit[last - 1] == '0') last--;
    if (value < 0) text[n++] = '-';
    if (place < 0) {
        memcpy(text + n, "0.000", 5);
        n += 1 - place;
        memcpy(text + n, digit, sizeof digit); /* all 17: a constant size is faster */
        return n + last;
    }
    memcpy(text + n, digit, sizeof digit);
    i = place + 1;
    if (last <= i) return n + i;
    text[n + i] = '.';
    memcpy(text + n + i + 1, digit + i, (size_t)(last - i));
    return n + last + 1;
}

/* A double, such that it reads back as the same bits, and the character after it. */
static void meshio__put_double(meshio__writer *w, double value, char after)
{
    char *text;
    int n;
    uint64_t bits;
    memcpy(&bits, &value, 8);
    if (value > -1e15 && value < 1e15 && value == (double)(int64_t)value &&
        bits != UINT64_C(1) << 63) {
        meshio__put_int(w, (int64_t)value, after);
        return;
    }
    text = meshio__room(w, 41);
    n = meshio__format_double(text, value);
    text[n] = after;
    w->used += (size_t)n + 1;
}

static void meshio__put_xyz(meshio__writer *w, const double *xyz)
{
    meshio__put_double(w, xyz[0], ' ');
    meshio__put_double(w, xyz[1], ' ');
    meshio__put_double(w, xyz[2], ' ');
}

/* An integer of 1, 4 or 8 bytes, in this machine's byte order, or in big-endian order (VTK). */
static void meshio__put_raw(meshio__writer *w, int64_t value, int bytes, int big_endian)
{
    char *raw = meshio__room(w, 8);
    int i;
    if (meshio__little_endian() && !big_endian) memcpy(raw, &value, 8); /* the lowest bytes first */
    else
        for (i = 0; i < bytes; i++) raw[bytes - 1 - i] = (char)((uint64_t)value >> (8 * i));
    w->used += (size_t)bytes;
}

/* An integer of 4 bytes in little-endian order, whatever this machine's is. */
static void meshio__put_little(meshio__writer *w, uint32_t value)
{
    char *raw = meshio__room(w, 4);
    int i;
    for (i = 0; i < 4; i++) raw[i] = (char)(value >> (8 * i));
    w->used += 4;
}

static void meshio__put_raw_double(meshio__writer *w, double value, int big_endian)
{
    uint64_t bits;
    memcpy(&bits, &value, 8);
    meshio__put_raw(w, (int64_t)bits, 8, big_endian);
}

static int meshio__is_device(const char *path)
{
#ifdef MESHIO__STAT
    struct stat status;
    if (stat(path, &status) == 0 && !S_ISREG(status.st_mode)) return 1;
#endif
    return strncmp(path, "/dev/", 5) == 0;
}

static meshio_result meshio__report_plain(meshio_report *report, meshio_result result,
                                          const char *what, const char *path, int error)
{
    report->result = result;
    snprintf(report->message, sizeof report->message, "%s '%.150s'%s%.80s", what, path,
             error ? ": " : "", error ? strerror(error) : "");
    return result;
}

static meshio_result meshio__report_words(meshio_report *report, meshio_result result,
                                          const char *words)
{
    report->result = result;
    snprintf(report->message, sizeof report->message, "%s", words);
    return result;
}

static meshio_result meshio__create(meshio__writer *w, const char *path, meshio_report *report)
{
    w->used = 0;
    w->offset = 0;
    w->failed = 0;
    w->error = 0;
    w->file = NULL;
    if (strlen(path) + 1 > sizeof w->path)
        return meshio__report_plain(report, MESHIO_ERROR_WRITE, "the name is too long:", path, 0);
    strcpy(w->path, path);
    w->direct = meshio__is_device(path);
    snprintf(w->part, sizeof w->part, "%s%s", path, w->direct ? "" : ".part");
    w->file = fopen(w->part, "wb");
    if (!w->file)
        return meshio__report_plain(report, MESHIO_ERROR_WRITE, "cannot create", w->part, errno);
    return MESHIO_OK;
}

/* Renames a file, in place of another one if that exists. Returns 0 on failure. */
static int meshio__replace(const char *from, const char *to)
{
    if (rename(from, to) == 0) return 1;
#ifdef _WIN32 /* where rename() does not replace a file */
    return errno == EEXIST && remove(to) == 0 && rename(from, to) == 0;
#else
    return 0;
#endif
}

/* Closes the file. If everything has been written, it gets its final name, else it is removed.
 * `result`: what writing it returned: MESHIO_OK or OUT_OF_MEMORY. */
static meshio_result meshio__complete(meshio__writer *w, meshio_result result,
                                      meshio_report *report)
{
    if (result != MESHIO_OK) w->failed = 1;
    meshio__flush(w);
    if (fflush(w->file) != 0 && !w->failed) w->failed = 1, w->error = errno;
    if (fclose(w->file) != 0 && !w->failed) w->failed = 1, w->error = errno;
    if (!w->failed && !w->direct && !meshio__replace(w->part, w->path))
        w->failed = 1, w->error = errno;
    if (!w->failed) return MESHIO_OK;
    if (!w->direct) remove(w->part);
    if (result != MESHIO_OK)
        return meshio__report_plain(report, result, "out of memory while writing", w->path, 0);
    return meshio__report_plain(report, MESHIO_ERROR_WRITE, "cannot write", w->path, w->error);
}

/* ---- >>writers ------------------------------------------------------------------------------- */

/* Writes items first .. last - 1 of a list; each has at most MESHIO__ITEM bytes. */
typedef void (*meshio__put_items)(meshio__writer *w, const void *list, size_t first, size_t last);
enum { MESHIO__ITEM = 256, MESHIO__PARTS = 16 /* for each thread */ };

#ifdef _OPENMP
/* Writes items first .. last - 1, at most as many as fit into the buffers of all parts. The threads
 * fill the parts, each part by one thread; then these are written in order. */
static void meshio__put_shared(meshio__writer *w, const void *list, size_t first, size_t last,
                               meshio__put_items put, meshio__writer *parts)
{
    const size_t each = sizeof w->buffer / MESHIO__ITEM;
    int64_t i, n = (int64_t)((last - first + each - 1) / each);
#  pragma omp parallel for schedule(dynamic, 1) num_threads(w->threads)
    for (i = 0; i < n; i++) {
        size_t begin = first + (size_t)i * each;
        parts[i].used = 0;
        put(&parts[i], list, begin, begin + each < last ? begin + each : last);
    }
    for (i = 0; i < n; i++) meshio__put(w, parts[i].buffer, parts[i].used);
}
#endif

/* Writes all n items of a list, in rounds. Where other programs use the processors, threads may
 * cost more time by waiting for each other than they save. So if a round shared by all threads
 * takes longer than one by this thread alone, this thread does the next rounds alone, for ten times
 * the time lost. */
static void meshio__put_list(meshio__writer *w, const void *list, size_t n, meshio__put_items put)
{
    size_t first = 0;
#ifdef _OPENMP
    size_t count = w->threads > 1 ? (size_t)w->threads * MESHIO__PARTS : 0;
    size_t round = count * (sizeof w->buffer / MESHIO__ITEM), last;
    meshio__writer *parts = NULL;
    double alone = -1, until = 0, start, end; /* alone: the least time of a round by one thread */
    if (round && n > 4 * round) parts = (meshio__writer *)MESHIO_MALLOC(count * sizeof *parts);
    for (; parts && first < n; first = last) {
        last = n - first < round ? n : first + round;
        start = omp_get_wtime();
        if (alone < 0 || start < until) put(w, list, first, last);
        else meshio__put_shared(w, list, first, last, put, parts);
        end = omp_get_wtime();
        if (alone < 0 || (start < until && end - start < alone)) alone = end - start;
        else if (start >= until && end - start > alone) until = end + 10 * (end - start - alone);
    }
    MESHIO_FREE(parts);
#endif
    put(w, list, first, n);
}

/* A kind of elements; the writers take edges, triangles, tetrahedra in this order. */
typedef struct meshio__kind {
    const uint32_t *v;
    const int32_t *tags;
    size_t num;
    int corners, gmsh, vtk; /* vertices of each; the types of Gmsh and VTK */
} meshio__kind;

static void meshio__kinds(const meshio_mesh *m, meshio__kind kinds[3])
{
    static const int numbers[2][3][3] = {{{2, 1, 3}, {3, 2, 5}, {4, 4, 10}},
                                         {{3, 8, 21}, {6, 9, 22}, {10, 11, 24}}};
    int k;
    kinds[0].v = m->edges;
    kinds[0].tags = m->edge_tags;
    kinds[0].num = m->num_edges;
    kinds[1].v = m->triangles;
    kinds[1].tags = m->triangle_tags;
    kinds[1].num = m->num_triangles;
    kinds[2].v = m->tets;
    kinds[2].tags = m->tet_tags;
    kinds[2].num = m->num_tets;
    for (k = 0; k < 3; k++) {
        const int *number = numbers[m->second_order != 0][k];
        kinds[k].corners = number[0];
        kinds[k].gmsh = number[1];
        kinds[k].vtk = number[2];
    }
}

static void meshio__put_medit_vertices(meshio__writer *w, const void *list, size_t first,
                                       size_t last)
{
    const meshio_mesh *m = (const meshio_mesh *)list;
    size_t i;
    for (i = first; i < last; i++) {
        meshio__put_xyz(w, m->xyz + 3 * i);
        meshio__put_int(w, m->vertex_tags ? m->vertex_tags[i] : 0, '\n');
    }
}

static void meshio__put_medit_cells(meshio__writer *w, const void *list, size_t first, size_t last)
{
    const meshio__kind *kind = (const meshio__kind *)list;
    size_t i, corners = (size_t)kind->corners, k;
    for (i = first; i < last; i++) {
        for (k = 0; k < corners; k++)
            meshio__put_int(w, (int64_t)kind->v[corners * i + k] + 1, ' ');
        meshio__put_int(w, kind->tags ? kind->tags[i] : 0, '\n');
    }
}

static void meshio__write_medit(meshio__writer *w, const meshio_mesh *m)
{
    static const char *const names[] = {"Edges", "Triangles", "Tetrahedra"};
    meshio__kind kinds[3];
    int k;
    meshio__kinds(m, kinds);
    meshio__printf(w, "MeshVersionFormatted 2\nDimension 3\nVertices\n%llu\n",
                   (unsigned long long)m->num_vertices);
    meshio__put_list(w, m, m->num_vertices, meshio__put_medit_vertices);
    for (k = 0; k < 3; k++) {
        if (kinds[k].num == 0) continue;
        meshio__printf(w, "%s\n%llu\n", names[k], (unsigned long long)kinds[k].num);
        meshio__put_list(w, &kinds[k], kinds[k].num, meshio__put_medit_cells);
    }
    meshio__puts(w, "End\n");
}

/* The beginning of a section with `bytes` bytes after the count; wide: positions have 64 bits. */
static void meshio__medit_section(meshio__writer *w, int code, size_t count, uint64_t bytes,
                                  int wide)
{
    uint64_t here = w->offset + w->used;
    meshio__put_raw(w, code, 4, 0);
    meshio__put_raw(w, (int64_t)(here + 4 + (wide ? 8 : 4) + 4 + bytes), wide ? 8 : 4, 0);
    meshio__put_raw(w, (int64_t)count, 4, 0);
}

static void meshio__write_medit_binary_cells(meshio__writer *w, int code, const uint32_t *v,
                                             const int32_t *tags, size_t num, int corners, int wide)
{
    size_t i;
    int k;
    if (num == 0) return;
    meshio__medit_section(w, code, num, (uint64_t)num * 4 * (uint64_t)(corners + 1), wide);
    for (i = 0; i < num; i++) {
        for (k = 0; k < corners; k++)
            meshio__put_raw(w, (int64_t)v[(size_t)corners * i + (size_t)k] + 1, 4, 0);
        meshio__put_raw(w, tags ? tags[i] : 0, 4, 0);
    }
}

/* Writes version 2, or 3 if positions need more than 31 bits. */
static void meshio__write_medit_binary(meshio__writer *w, const meshio_mesh *m)
{
    uint64_t bytes = 28 * (uint64_t)m->num_vertices + 12 * (uint64_t)m->num_edges +
                     16 * (uint64_t)m->num_triangles + 20 * (uint64_t)m->num_tets + 1024;
    int wide = bytes > 0x7FFFFFFF, k;
    size_t i;
    meshio__put_raw(w, 1, 4, 0);
    meshio__put_raw(w, wide ? 3 : 2, 4, 0);
    meshio__medit_section(w, MESHIO__MEDIT_DIMENSION, 3, 0, wide);
    meshio__medit_section(w, MESHIO__MEDIT_VERTICES, m->num_vertices,
                          28 * (uint64_t)m->num_vertices, wide);
    for (i = 0; i < m->num_vertices; i++) {
        for (k = 0; k < 3; k++) meshio__put_raw_double(w, m->xyz[3 * i + (size_t)k], 0);
        meshio__put_raw(w, m->vertex_tags ? m->vertex_tags[i] : 0, 4, 0);
    }
    meshio__write_medit_binary_cells(w, MESHIO__MEDIT_EDGES, m->edges, m->edge_tags, m->num_edges,
                                     2, wide);
    meshio__write_medit_binary_cells(w, MESHIO__MEDIT_TRIANGLES, m->triangles, m->triangle_tags,
                                     m->num_triangles, 3, wide);
    meshio__write_medit_binary_cells(w, MESHIO__MEDIT_TETS, m->tets, m->tet_tags, m->num_tets, 4,
                                     wide);
    meshio__put_raw(w, MESHIO__MEDIT_END, 4, 0);
    meshio__put_raw(w, 0, wide ? 8 : 4, 0);
}

/* An integer, in binary of the given width or in text with a blank after it. */
static void meshio__put_any(meshio__writer *w, int binary, int bytes, int64_t value)
{
    if (binary)
        meshio__put_raw(w, value, bytes, 0);
    else
        meshio__put_int(w, value, ' ');
}

static void meshio__put_newline(meshio__writer *w, int binary)
{
    if (!binary) meshio__put(w, "\n", 1);
}

static void meshio__write_msh_header(meshio__writer *w, const char *version, int binary)
{
    meshio__printf(w, "$MeshFormat\n%s %d 8\n", version, binary);
    if (binary) {
        meshio__put_raw(w, 1, 4, 0);
        meshio__puts(w, "\n");
    }
    meshio__puts(w, "$EndMeshFormat\n");
}

static void meshio__write_msh_names(meshio__writer *w, const meshio_mesh *m)
{
    size_t i;
    if (!m->num_names) return;
    meshio__printf(w, "$PhysicalNames\n%llu\n", (unsigned long long)m->num_names);
    for (i = 0; i < m->num_names; i++)
        meshio__printf(w, "%d %ld \"%.127s\"\n", m->names[i].dimension, (long)m->names[i].tag,
                       m->names[i].text);
    meshio__puts(w, "$EndPhysicalNames\n");
}

/* A list of nodes or elements in an MSH 2.2 file. */
typedef struct meshio__msh2_list {
    const meshio_mesh *mesh;
    const meshio__kind *kind;
    size_t id; /* of the element before the first */
    int binary;
} meshio__msh2_list;

static void meshio__put_msh2_nodes(meshio__writer *w, const void *list, size_t first, size_t last)
{
    const meshio__msh2_list *l = (const meshio__msh2_list *)list;
    const double *xyz = l->mesh->xyz;
    size_t i;
    int c;
    for (i = first; i < last; i++) {
        meshio__put_any(w, l->binary, 4, (int64_t)i + 1);
        for (c = 0; c < 3; c++)
            if (l->binary)
                meshio__put_raw_double(w, xyz[3 * i + (size_t)c], 0);
            else
                meshio__put_double(w, xyz[3 * i + (size_t)c], c < 2 ? ' ' : '\n');
    }
}

/* The number of the entity that elements with a tag belong to. Gmsh drops elements of entities with
 * negative numbers. */
static int32_t meshio__msh2_entity(int32_t tag)
{
    return tag < 0 ? (int32_t)(0x40000000 | (-(int64_t)tag & 0x3fffffff)) : tag;
}

/* The text of type and tags is reused, as it is mostly the same for one element after another. */
static void meshio__put_msh2_elements(meshio__writer *w, const void *list, size_t first,
                                      size_t last)
{
    const meshio__msh2_list *l = (const meshio__msh2_list *)list;
    const meshio__kind *kind = l->kind;
    size_t corners = (size_t)kind->corners, i, c;
    int length = 0;
    int32_t before = 0;
    char tags[64];
    for (i = first; i < last; i++) {
        int32_t tag = kind->tags ? kind->tags[i] : 0;
        meshio__put_any(w, l->binary, 4, (int64_t)(l->id + i + 1));
        if (l->binary) {
            meshio__put_raw(w, tag, 4, 0);
            meshio__put_raw(w, meshio__msh2_entity(tag), 4, 0);
        } else {
            if (length == 0 || tag != before)
                length = snprintf(tags, sizeof tags, "%d 2 %ld %ld ", kind->gmsh, (long)tag,
                                  (long)meshio__msh2_entity(tag));
            before = tag;
            meshio__put(w, tags, (size_t)length);
        }
        for (c = 0; c < corners; c++) { /* Gmsh has the last two midpoints of tets as 23, 13 */
            size_t at = corners == 10 && c >= 8 ? 17 - c : c;
            meshio__put_any(w, l->binary, 4, (int64_t)kind->v[i * corners + at] + 1);
        }
        meshio__put_newline(w, l->binary);
    }
}

static void meshio__write_msh2(meshio__writer *w, const meshio_mesh *m, int binary)
{
    meshio__kind kinds[3];
    meshio__msh2_list list;
    int k;
    meshio__kinds(m, kinds);
    list.mesh = m;
    list.id = 0;
    list.binary = binary;
    meshio__write_msh_header(w, "2.2", binary);
    meshio__write_msh_names(w, m);
    meshio__printf(w, "$Nodes\n%llu\n", (unsigned long long)m->num_vertices);
    meshio__put_list(w, &list, m->num_vertices, meshio__put_msh2_nodes);
    meshio__printf(w, "%s$EndNodes\n$Elements\n%llu\n", binary ? "\n" : "",
                   (unsigned long long)(m->num_edges + m->num_triangles + m->num_tets));
    for (k = 0; k < 3; k++) {
        if (binary && kinds[k].num) { /* one block for each kind */
            meshio__put_raw(w, kinds[k].gmsh, 4, 0);
            meshio__put_raw(w, (int64_t)kinds[k].num, 4, 0);
            meshio__put_raw(w, 2, 4, 0);
        }
        list.kind = &kinds[k];
        meshio__put_list(w, &list, kinds[k].num, meshio__put_msh2_elements);
        list.id += kinds[k].num;
    }
    meshio__printf(w, "%s$EndElements\n", binary ? "\n" : "");
}

static int meshio__compare_tags(const void *pa, const void *pb)
{
    const int64_t *a = (const int64_t *)pa, *b = (const int64_t *)pb;
    if (a[0] != b[0]) return a[0] < b[0] ? -1 : 1;
    return a[1] < b[1] ? -1 : a[1] > b[1];
}

/* The elements of a kind by tags, for MSH 4.1 and .inp: pairs (tag, element), sorted, and the
 * number of distinct tags. */
typedef struct meshio__groups {
    int64_t *pairs;
    size_t num, distinct;
} meshio__groups;

static int meshio__group(const meshio__kind *kind, meshio__groups *groups)
{
    size_t i;
    groups->num = kind->num;
    groups->distinct = 0;
    groups->pairs = NULL;
    if (kind->num == 0) return 1;
    if (kind->num > (size_t)-1 / 16) return 0;
    groups->pairs = (int64_t *)MESHIO_MALLOC(16 * kind->num);
    if (!groups->pairs) return 0;
    for (i = 0; i < kind->num; i++) {
        groups->pairs[2 * i] = kind->tags ? kind->tags[i] : 0;
        groups->pairs[2 * i + 1] = (int64_t)i;
    }
    qsort(groups->pairs, kind->num, 16, meshio__compare_tags);
    for (i = 0; i < kind->num; i++)
        groups->distinct += i == 0 || groups->pairs[2 * i] != groups->pairs[2 * i - 2];
    return 1;
}

static void meshio__bounding_box(const meshio_mesh *m, double box[6])
{
    size_t i;
    int k;
    for (k = 0; k < 6; k++) box[k] = 0;
    for (i = 0; i < m->num_vertices; i++)
        for (k = 0; k < 3; k++) {
            double x = m->xyz[3 * i + (size_t)k];
            if (i == 0 || x < box[k]) box[k] = x;
            if (i == 0 || x > box[3 + k]) box[3 + k] = x;
        }
}

/* Writes one entity for each tag of each kind, in a physical group of the same number. */
static void meshio__write_msh4_entities(meshio__writer *w, const meshio__groups *groups,
                                        const double box[6], int binary)
{
    int k, c;
    size_t i;
    meshio__puts(w, "$Entities\n");
    meshio__put_any(w, binary, 8, 0);
    for (k = 0; k < 3; k++) meshio__put_any(w, binary, 8, (int64_t)groups[k].distinct);
    meshio__put_newline(w, binary);
    for (k = 0; k < 3; k++)
        for (i = 0; i < groups[k].num; i++) {
            int64_t tag = groups[k].pairs[2 * i];
            if (i > 0 && tag == groups[k].pairs[2 * i - 2]) continue;
            meshio__put_any(w, binary, 4, tag);
            for (c = 0; c < 6; c++)
                if (binary)
                    meshio__put_raw_double(w, box[c], 0);
                else
                    meshio__put_double(w, box[c], ' ');
            meshio__put_any(w, binary, 8, tag != 0);
            if (tag != 0) meshio__put_any(w, binary, 4, tag);
            meshio__put_any(w, binary, 8, 0);
            meshio__put_newline(w, binary);
        }
    meshio__printf(w, "%s$EndEntities\n", binary ? "\n" : "");
}

static void meshio__write_msh4_nodes(meshio__writer *w, const meshio_mesh *m,
                                     const meshio__groups *groups, int binary)
{
    size_t i;
    int dimension = m->num_tets ? 3 : m->num_triangles ? 2 : m->num_edges ? 1 : 0;
    int64_t n = (int64_t)m->num_vertices;
    meshio__puts(w, "$Nodes\n");
    meshio__put_any(w, binary, 8, n > 0);
    meshio__put_any(w, binary, 8, n);
    meshio__put_any(w, binary, 8, n > 0);
    meshio__put_any(w, binary, 8, n);
    meshio__put_newline(w, binary);
    if (n > 0) {
        meshio__put_any(w, binary, 4, dimension);
        meshio__put_any(w, binary, 4, dimension ? groups[dimension - 1].pairs[0] : 0);
        meshio__put_any(w, binary, 4, 0);
        meshio__put_any(w, binary, 8, n);
        meshio__put_newline(w, binary);
    }
    for (i = 0; i < m->num_vertices; i++) {
        meshio__put_any(w, binary, 8, (int64_t)i + 1);
        meshio__put_newline(w, binary);
    }
    for (i = 0; i < 3 * m->num_vertices; i++)
        if (binary)
            meshio__put_raw_double(w, m->xyz[i], 0);
        else
            meshio__put_double(w, m->xyz[i], i % 3 < 2 ? ' ' : '\n');
    meshio__printf(w, "%s$EndNodes\n", binary ? "\n" : "");
}

static meshio_result meshio__write_msh4(meshio__writer *w, const meshio_mesh *m, int binary)
{
    meshio__kind kinds[3];
    meshio__groups groups[3];
    double box[6];
    size_t i, j, id = 0, blocks = 0, total = 0;
    int k, c, ok = 1;
    memset(groups, 0, sizeof groups);
    meshio__kinds(m, kinds);
    for (k = 0; ok && k < 3; k++) {
        ok = meshio__group(&kinds[k], &groups[k]);
        blocks += groups[k].distinct;
        total += groups[k].num;
    }
    if (ok) {
        meshio__bounding_box(m, box);
        meshio__write_msh_header(w, "4.1", binary);
        meshio__write_msh_names(w, m);
        meshio__write_msh4_entities(w, groups, box, binary);
        meshio__write_msh4_nodes(w, m, groups, binary);
        meshio__puts(w, "$Elements\n");
        meshio__put_any(w, binary, 8, (int64_t)blocks);
        meshio__put_any(w, binary, 8, (int64_t)total);
        meshio__put_any(w, binary, 8, total > 0);
        meshio__put_any(w, binary, 8, (int64_t)total);
        meshio__put_newline(w, binary);
        for (k = 0; k < 3; k++)
            for (i = 0; i < groups[k].num; i++) {
                const int64_t *pair = groups[k].pairs + 2 * i;
                size_t n = (size_t)kinds[k].corners;
                if (i == 0 || pair[0] != pair[-2]) {
                    for (j = i; j < groups[k].num && groups[k].pairs[2 * j] == pair[0];) j++;
                    meshio__put_any(w, binary, 4, k + 1);
                    meshio__put_any(w, binary, 4, pair[0]);
                    meshio__put_any(w, binary, 4, kinds[k].gmsh);
                    meshio__put_any(w, binary, 8, (int64_t)(j - i));
                    meshio__put_newline(w, binary);
                }
                meshio__put_any(w, binary, 8, (int64_t)++id);
                for (c = 0; c < kinds[k].corners; c++)
                    meshio__put_any(w, binary, 8,
                                    (int64_t)kinds[k].v[(size_t)pair[1] * n + (size_t)c] + 1);
                meshio__put_newline(w, binary);
            }
        meshio__printf(w, "%s$EndElements\n", binary ? "\n" : "");
    }
    for (k = 0; k < 3; k++) MESHIO_FREE(groups[k].pairs);
    return ok ? MESHIO_OK : MESHIO_ERROR_OUT_OF_MEMORY;
}

/* ---- What VTU and VTK files share. Numbers are text if `order` is -1, else raw bytes: big-endian
 * if it is 1, in this machine's order if it is 0. */

static void meshio__put_real(meshio__writer *w, double value, int order, char after)
{
    if (order < 0)
        meshio__put_double(w, value, after);
    else
        meshio__put_raw_double(w, value, order);
}

static void meshio__put_points(meshio__writer *w, const meshio_mesh *m, int order)
{
    size_t i;
    for (i = 0; i < 3 * m->num_vertices; i++)
        meshio__put_real(w, m->xyz[i], order, i % 3 == 2 ? '\n' : ' ');
}

static void meshio__put_values(meshio__writer *w, const meshio__kind kinds[3],
                               const meshio_field *field, int order)
{
    int k;
    size_t i;
    for (k = 0; k < 3; k++) {
        const double *values = k == 0 ? field->edges : k == 1 ? field->triangles : field->tets;
        for (i = 0; i < kinds[k].num; i++)
            meshio__put_real(w, values ? values[i] : 0, order, '\n');
    }
}

/* ---- VTU: each array has a tag; its data are in it (ASCII) or follow at the end, at an offset. */

enum { MESHIO__VTU_CORNERS, MESHIO__VTU_OFFSETS, MESHIO__VTU_TYPES, MESHIO__VTU_TAGS };

typedef struct meshio__vtu_writer {
    meshio__writer *w;
    const meshio_mesh *mesh;
    const meshio_write_options *options;
    meshio__kind kinds[3];
    int order, wide;   /* wide: 64-bit integers */
    uint64_t cells;    /* their number */
    uint64_t bytes[4]; /* of their integer arrays */
    uint64_t offset;   /* of the next appended array */
} meshio__vtu_writer;

static void meshio__vtu_start(meshio__vtu_writer *u, meshio__writer *w, const meshio_mesh *m,
                              const meshio_write_options *options)
{
    uint64_t corners = 0, word;
    int k;
    u->w = w;
    u->mesh = m;
    u->options = options;
    meshio__kinds(m, u->kinds);
    for (k = 0, u->cells = 0; k < 3; k++) {
        u->cells += u->kinds[k].num;
        corners += (uint64_t)u->kinds[k].corners * u->kinds[k].num;
    }
    u->order = options->ascii ? -1 : 0;
    u->wide = corners > 0x7FFFFFFF || m->num_vertices > 0x7FFFFFFF;
    word = u->wide ? 8 : 4;
    u->bytes[MESHIO__VTU_CORNERS] = corners * word;
    u->bytes[MESHIO__VTU_OFFSETS] = u->cells * word;
    u->bytes[MESHIO__VTU_TYPES] = u->cells;
    u->bytes[MESHIO__VTU_TAGS] = u->cells * 4;
    u->offset = 0;
}

/* Writes one of the integer arrays of the cells. */
static void meshio__vtu_integers(meshio__vtu_writer *u, int what)
{
    const meshio__kind *kinds = u->kinds;
    int bytes = what == MESHIO__VTU_TYPES ? 1 : what == MESHIO__VTU_TAGS ? 4 : u->wide ? 8 : 4;
    int64_t offset = 0;
    int k, c;
    size_t i;
    for (k = 0; k < 3; k++)
        for (i = 0; i < kinds[k].num; i++) {
            int n = what == MESHIO__VTU_CORNERS ? kinds[k].corners : 1;
            offset += kinds[k].corners;
            for (c = 0; c < n; c++) {
                int64_t value = what == MESHIO__VTU_OFFSETS ? offset
                                : what == MESHIO__VTU_TYPES ? kinds[k].vtk
                                : what == MESHIO__VTU_TAGS
                                    ? (kinds[k].tags ? kinds[k].tags[i] : 0)
                                    : (int64_t)kinds[k].v[i * (size_t)kinds[k].corners + (size_t)c];
                if (u->order < 0)
                    meshio__put_int(u->w, value, c + 1 < n || i % 16 != 15 ? ' ' : '\n');
                else
                    meshio__put_raw(u->w, value, bytes, 0);
            }
        }
}

/* Writes the XML tag of an array. Returns whether the data must follow at once (ASCII); else the
 * tag has their offset in the appended data. */
static int meshio__vtu_tag(meshio__vtu_writer *u, const char *type, const char *name,
                           int components, uint64_t bytes)
{
    meshio__printf(u->w, "<DataArray type=\"%s\" Name=\"%.100s\" NumberOfComponents=\"%d\" ", type,
                   name, components);
    if (u->order < 0) {
        meshio__puts(u->w, "format=\"ascii\">\n");
    } else {
        meshio__printf(u->w, "format=\"appended\" offset=\"%llu\"/>\n",
                       (unsigned long long)u->offset);
        u->offset += 8 + bytes;
    }
    return u->order < 0;
}

static void meshio__vtu_tag_end(meshio__vtu_writer *u)
{
    if (u->order < 0) meshio__puts(u->w, "\n</DataArray>\n");
}

/* Writes the tags of the integer arrays of the cells, in text with the data. */
static void meshio__vtu_cells(meshio__vtu_writer *u)
{
    static const char *const names[] = {"connectivity", "offsets", "types", "region"};
    int what;
    for (what = 0; what < 4; what++) {
        const char *type = what == MESHIO__VTU_TYPES  ? "UInt8"
                           : what == MESHIO__VTU_TAGS ? "Int32"
                           : u->wide                  ? "Int64"
                                                      : "Int32";
        if (what == MESHIO__VTU_TAGS)
            meshio__puts(u->w, "</Cells>\n<CellData Scalars=\"region\">\n");
        if (meshio__vtu_tag(u, type, names[what], 1, u->bytes[what])) meshio__vtu_integers(u, what);
        meshio__vtu_tag_end(u);
    }
}

/* Writes the data of all arrays, in the order of their tags. */
static void meshio__vtu_appended(meshio__vtu_writer *u)
{
    size_t f;
    int what;
    meshio__puts(u->w, "<AppendedData encoding=\"raw\">\n_");
    meshio__put_raw(u->w, (int64_t)(24 * (uint64_t)u->mesh->num_vertices), 8, 0);
    meshio__put_points(u->w, u->mesh, u->order);
    for (what = 0; what < 4; what++) {
        meshio__put_raw(u->w, (int64_t)u->bytes[what], 8, 0);
        meshio__vtu_integers(u, what);
    }
    for (f = 0; f < u->options->num_fields; f++) {
        meshio__put_raw(u->w, (int64_t)(8 * u->cells), 8, 0);
        meshio__put_values(u->w, u->kinds, &u->options->fields[f], u->order);
    }
    meshio__puts(u->w, "\n</AppendedData>\n");
}

static void meshio__write_vtu(meshio__writer *w, const meshio_mesh *m,
                              const meshio_write_options *options)
{
    meshio__vtu_writer u;
    size_t f;
    meshio__vtu_start(&u, w, m, options);
    meshio__printf(w,
                   "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" "
                   "byte_order=\"%s\" header_type=\"UInt64\">\n<UnstructuredGrid>\n"
                   "<Piece NumberOfPoints=\"%llu\" NumberOfCells=\"%llu\">\n<Points>\n",
                   meshio__little_endian() ? "LittleEndian" : "BigEndian",
                   (unsigned long long)m->num_vertices, (unsigned long long)u.cells);
    if (meshio__vtu_tag(&u, "Float64", "Points", 3, 24 * (uint64_t)m->num_vertices))
        meshio__put_points(w, m, u.order);
    meshio__vtu_tag_end(&u);
    meshio__puts(w, "</Points>\n<Cells>\n");
    meshio__vtu_cells(&u);
    for (f = 0; f < options->num_fields; f++) {
        if (meshio__vtu_tag(&u, "Float64", options->fields[f].name, 1, 8 * u.cells))
            meshio__put_values(w, u.kinds, &options->fields[f], u.order);
        meshio__vtu_tag_end(&u);
    }
    meshio__puts(w, "</CellData>\n</Piece>\n</UnstructuredGrid>\n");
    if (u.order == 0) meshio__vtu_appended(&u);
    meshio__puts(w, "</VTKFile>\n");
}

static void meshio__vtk_int(meshio__writer *w, int binary, int64_t value, char after)
{
    if (binary)
        meshio__put_raw(w, value, 4, 1);
    else
        meshio__put_int(w, value, after);
}

static void meshio__write_vtk(meshio__writer *w, const meshio_mesh *m,
                              const meshio_write_options *options)
{
    meshio__kind kinds[3];
    uint64_t cells = (uint64_t)m->num_edges + m->num_triangles + m->num_tets;
    uint64_t size = 3 * (uint64_t)m->num_edges + 4 * (uint64_t)m->num_triangles +
                    5 * (uint64_t)m->num_tets;
    int binary = options->binary, k, c;
    size_t i, f;
    meshio__kinds(m, kinds);
    meshio__printf(w,
                   "# vtk DataFile Version 3.0\nmesh\n%s\nDATASET UNSTRUCTURED_GRID\n"
                   "POINTS %llu double\n",
                   binary ? "BINARY" : "ASCII", (unsigned long long)m->num_vertices);
    meshio__put_points(w, m, binary ? 1 : -1);
    meshio__printf(w, "\nCELLS %llu %llu\n", (unsigned long long)cells, (unsigned long long)size);
    for (k = 0; k < 3; k++)
        for (i = 0; i < kinds[k].num; i++) {
            int n = kinds[k].corners;
            meshio__vtk_int(w, binary, n, ' ');
            for (c = 0; c < n; c++)
                meshio__vtk_int(w, binary, (int64_t)kinds[k].v[i * (size_t)n + (size_t)c],
                                c + 1 < n ? ' ' : '\n');
        }
    meshio__printf(w, "\nCELL_TYPES %llu\n", (unsigned long long)cells);
    for (k = 0; k < 3; k++)
        for (i = 0; i < kinds[k].num; i++) meshio__vtk_int(w, binary, kinds[k].vtk, '\n');
    meshio__printf(w, "\nCELL_DATA %llu\nSCALARS region int 1\nLOOKUP_TABLE default\n",
                   (unsigned long long)cells);
    for (k = 0; k < 3; k++)
        for (i = 0; i < kinds[k].num; i++)
            meshio__vtk_int(w, binary, kinds[k].tags ? kinds[k].tags[i] : 0, '\n');
    for (f = 0; f < options->num_fields; f++) {
        meshio__printf(w, "\nSCALARS %.100s double 1\nLOOKUP_TABLE default\n",
                       options->fields[f].name);
        meshio__put_values(w, kinds, &options->fields[f], binary ? 1 : -1);
    }
    meshio__puts(w, "\n");
}

/* ---- INP: triangles that are facets of tetrahedra become surfaces, to which loads are applied.
 * The sides of a triangle are told apart by the vertices, for tetrahedra of positive volume. */

/* A double in at most 20 characters, as CalculiX reads no more of a number: 13 digits or more. */
static void meshio__put_short_double(meshio__writer *w, double value, const char *after)
{
    char text[40];
    int n = meshio__format_double(text, value), digits;
    for (digits = 16; n > 20; digits--) n = snprintf(text, sizeof text, "%.*g", digits, value);
    meshio__put(w, text, (size_t)n);
    meshio__puts(w, after);
}

static void meshio__put_inp_nodes(meshio__writer *w, const void *list, size_t first, size_t last)
{
    const meshio_mesh *m = (const meshio_mesh *)list;
    size_t i;
    for (i = first; i < last; i++) {
        meshio__put_int(w, (int64_t)i + 1, ',');
        meshio__put_short_double(w, m->xyz[3 * i], ",");
        meshio__put_short_double(w, m->xyz[3 * i + 1], ",");
        meshio__put_short_double(w, m->xyz[3 * i + 2], "\n");
    }
}

/* Elements of one kind, in the order of their tags. */
typedef struct meshio__inp_list {
    const meshio__kind *kind;
    const int64_t *pairs;
    size_t id; /* of the element before the first */
} meshio__inp_list;

static void meshio__put_inp_elements(meshio__writer *w, const void *list, size_t first, size_t last)
{
    const meshio__inp_list *l = (const meshio__inp_list *)list;
    size_t corners = (size_t)l->kind->corners, i, k;
    for (i = first; i < last; i++) {
        size_t e = (size_t)l->pairs[2 * i + 1];
        meshio__put_int(w, (int64_t)(l->id + e + 1), ',');
        for (k = 0; k < corners; k++)
            meshio__put_int(w, (int64_t)l->kind->v[corners * e + k] + 1,
                            k + 1 < corners ? ',' : '\n');
    }
}

/* Writes the line that begins a set: `card` is all of it but the number at the end. */
static void meshio__put_inp_card(meshio__writer *w, const char *card, int64_t tag)
{
    meshio__printf(w, "%s%s%lld\n", card, tag < 0 ? "M" : "", (long long)(tag < 0 ? -tag : tag));
}

/* A triangle with its corners in ascending order. */
typedef struct meshio__corners {
    uint32_t v[3], triangle;
} meshio__corners;

static int meshio__compare_corners(const void *pa, const void *pb)
{
    const meshio__corners *a = (const meshio__corners *)pa, *b = (const meshio__corners *)pb;
    int k;
    for (k = 0; k < 3; k++)
        if (a->v[k] != b->v[k]) return a->v[k] < b->v[k] ? -1 : 1;
    return 0;
}

static meshio__corners meshio__sorted_corners(uint32_t a, uint32_t b, uint32_t c)
{
    meshio__corners s;
    uint32_t low = a < b ? a : b, high = a < b ? b : a;
    s.v[0] = low < c ? low : c;
    s.v[2] = high > c ? high : c;
    s.v[1] = low > c ? low : high < c ? high : c;
    s.triangle = 0;
    return s;
}

/* Whether corners c are those of a triangle in its order, from any of them on. */
static int meshio__turns_alike(const uint32_t *triangle, const uint32_t c[3])
{
    int k = c[0] == triangle[0] ? 0 : c[0] == triangle[1] ? 1 : 2;
    return c[1] == triangle[(k + 1) % 3];
}

/* The facets of a tetrahedron as .inp numbers them, their vertices clockwise seen from outside. */
static const unsigned char meshio__inp_facets[4][3] = {{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}};

/* Sets the two owners of each triangle: 4 * t + k + 1 if it is facet S(k+1) of tetrahedron t, 0 if
 * there is none; the first one is behind the triangle, so that it is counter-clockwise seen from
 * outside. sorted: memory for all triangles; marks: zeros, one for each vertex. */
static void meshio__find_owners(const meshio__kind kinds[3], uint64_t *owners,
                                meshio__corners *sorted, unsigned char *marks)
{
    size_t n = kinds[1].num, corners = (size_t)kinds[1].corners, t, i;
    int k, c;
    for (t = 0; t < n; t++) {
        const uint32_t *v = kinds[1].v + corners * t;
        sorted[t] = meshio__sorted_corners(v[0], v[1], v[2]);
        sorted[t].triangle = (uint32_t)t;
        for (k = 0; k < 3; k++) marks[v[k]] = 1;
        owners[2 * t] = owners[2 * t + 1] = 0;
    }
    qsort(sorted, n, sizeof *sorted, meshio__compare_corners);
    for (t = 0; t < kinds[2].num; t++) {
        const uint32_t *v = kinds[2].v + (size_t)kinds[2].corners * t;
        for (k = 0; k < 4; k++) {
            uint32_t f[3];
            meshio__corners key;
            size_t low = 0, high = n;
            for (c = 0; c < 3; c++) f[c] = v[meshio__inp_facets[k][c]];
            if (!(marks[f[0]] && marks[f[1]] && marks[f[2]])) continue;
            key = meshio__sorted_corners(f[0], f[1], f[2]);
            while (low < high) {
                size_t mid = low + (high - low) / 2;
                if (meshio__compare_corners(&sorted[mid], &key) < 0) low = mid + 1;
                else high = mid;
            }
            for (i = low; i < n && meshio__compare_corners(&sorted[i], &key) == 0; i++) {
                size_t at = sorted[i].triangle;
                owners[2 * at + (size_t)meshio__turns_alike(kinds[1].v + corners * at, f)] =
                    4 * (uint64_t)t + (uint64_t)k + 1;
            }
        }
    }
}

/* The region of an owner. */
static int32_t meshio__region_of(const meshio__kind *tets, uint64_t owner)
{
    return tets->tags ? tets->tags[(owner - 1) / 4] : 0;
}

static int meshio__compare_i32(const void *pa, const void *pb)
{
    int32_t a = *(const int32_t *)pa, b = *(const int32_t *)pb;
    return a < b ? -1 : a > b;
}

/* The region that is behind most of the n triangles of one tag; the first of several. room: memory
 * for as many numbers. */
static int32_t meshio__region_behind(const meshio__kind *tets, const int64_t *pairs, size_t n,
                                     const uint64_t *owners, int32_t *room)
{
    size_t i, k, num = 0, most = 0;
    int32_t region = 0;
    for (i = 0; i < n; i++) {
        uint64_t behind = owners[2 * (size_t)pairs[2 * i + 1]];
        if (behind) room[num++] = meshio__region_of(tets, behind);
    }
    qsort(room, num, sizeof *room, meshio__compare_i32);
    for (i = 0; i < num; i = k) {
        for (k = i; k < num && room[k] == room[i];) k++;
        if (k - i <= most) continue;
        most = k - i;
        region = room[i];
    }
    return region;
}

/* Makes the first owner of each triangle the one whose facet stands for it in the surface of its
 * tag: where just one of the two is in the region that is behind most of the surface, that one, so
 * that the whole surface is on one side even if some triangles are turned over; else the one behind
 * the triangle, or the only one. Returns 0 if out of memory. */
static int meshio__choose_sides(const meshio__kind kinds[3], const meshio__groups *groups,
                                uint64_t *owners)
{
    int32_t *room = (int32_t *)MESHIO_MALLOC((groups->num + 1) * sizeof *room), region;
    size_t i, j;
    if (!room) return 0;
    for (i = 0; i < groups->num; i = j) {
        for (j = i; j < groups->num && groups->pairs[2 * j] == groups->pairs[2 * i];) j++;
        region = meshio__region_behind(&kinds[2], groups->pairs + 2 * i, j - i, owners, room);
        for (; i < j; i++) {
            uint64_t *o = owners + 2 * (size_t)groups->pairs[2 * i + 1];
            if (!o[1]) continue;
            if (!o[0] || (meshio__region_of(&kinds[2], o[0]) != region &&
                          meshio__region_of(&kinds[2], o[1]) == region))
                o[0] = o[1];
        }
    }
    MESHIO_FREE(room);
    return 1;
}

/* Writes the elements of one kind, by tags; of triangles (`owners` given) only those that no
 * tetrahedron owns. */
static void meshio__write_inp_elements(meshio__writer *w, const meshio__kind *kind,
                                       const meshio__groups *groups, const uint64_t *owners,
                                       const char *card, size_t id)
{
    meshio__inp_list list;
    size_t i, j;
    list.kind = kind;
    list.id = id;
    for (i = 0; i < groups->num; i = j) {
        int64_t tag = groups->pairs[2 * i];
        list.pairs = groups->pairs + 2 * i;
        for (j = i; j < groups->num && groups->pairs[2 * j] == tag;) j++;
        if (!owners) {
            meshio__put_inp_card(w, card, tag);
            meshio__put_list(w, &list, j - i, meshio__put_inp_elements);
        } else {
            size_t k, n = 0;
            for (k = 0; k < j - i; k++) {
                if (owners[2 * list.pairs[2 * k + 1]]) continue;
                if (n++ == 0) meshio__put_inp_card(w, card, tag);
                meshio__put_inp_elements(w, &list, k, k + 1);
            }
        }
    }
}

/* Writes the triangles that tetrahedra own as surfaces, one for each tag. */
static void meshio__write_inp_surfaces(meshio__writer *w, const meshio__groups *groups,
                                       const uint64_t *owners)
{
    size_t i, n = 0;
    for (i = 0; i < groups->num; i++) {
        uint64_t o = owners[2 * groups->pairs[2 * i + 1]];
        if (i > 0 && groups->pairs[2 * i] != groups->pairs[2 * i - 2]) n = 0;
        if (o == 0) continue;
        if (n++ == 0)
            meshio__put_inp_card(w, "*SURFACE, TYPE=ELEMENT, NAME=SURFACE_", groups->pairs[2 * i]);
        meshio__put_int(w, (int64_t)((o - 1) / 4 + 1), ',');
        meshio__printf(w, "S%d\n", (int)((o - 1) % 4 + 1));
    }
}

/* Writes for each tag the set of the vertices of its elements, each once; stamps: zeros, one for
 * each vertex. */
static void meshio__write_inp_node_sets(meshio__writer *w, const meshio__kind *kind,
                                        const meshio__groups *groups, const char *card,
                                        uint32_t *stamps)
{
    size_t i, corners = (size_t)kind->corners, k;
    uint32_t stamp = 0;
    for (i = 0; i < groups->num; i++) {
        const int64_t *pair = groups->pairs + 2 * i;
        if (i == 0 || pair[0] != pair[-2]) {
            meshio__put_inp_card(w, card, pair[0]);
            stamp++;
        }
        for (k = 0; k < corners; k++) {
            uint32_t v = kind->v[corners * (size_t)pair[1] + k];
            if (stamps[v] == stamp) continue;
            stamps[v] = stamp;
            meshio__put_int(w, (int64_t)v + 1, '\n');
        }
    }
}

static meshio_result meshio__write_inp(meshio__writer *w, const meshio_mesh *m)
{
    meshio__kind kinds[3];
    meshio__groups groups[3];
    size_t n = m->num_vertices, t = m->num_triangles;
    int k, ok = n < (size_t)-1 / sizeof(uint32_t) && t < (size_t)-1 / (2 * sizeof(uint64_t)) - 1;
    uint32_t *stamps = ok ? (uint32_t *)MESHIO_MALLOC((n + 1) * sizeof *stamps) : NULL;
    uint64_t *owners = ok ? (uint64_t *)MESHIO_MALLOC((2 * t + 1) * sizeof *owners) : NULL;
    meshio__corners *sorted =
        ok ? (meshio__corners *)MESHIO_MALLOC((t + 1) * sizeof *sorted) : NULL;
    ok = stamps && owners && sorted;
    memset(groups, 0, sizeof groups);
    meshio__kinds(m, kinds);
    for (k = 0; ok && k < 3; k++) ok = meshio__group(&kinds[k], &groups[k]);
    if (ok) {
        memset(stamps, 0, (n + 1) * sizeof *stamps);
        meshio__find_owners(kinds, owners, sorted, (unsigned char *)stamps);
        ok = meshio__choose_sides(kinds, &groups[1], owners);
    }
    if (ok) {
        meshio__printf(w, "*HEADING\nmesh %s\n*NODE, NSET=ALL\n", m->name);
        meshio__put_list(w, m, n, meshio__put_inp_nodes);
        meshio__write_inp_elements(w, &kinds[2], &groups[2], NULL,
                                   m->second_order ? "*ELEMENT, TYPE=C3D10, ELSET=REGION_"
                                                   : "*ELEMENT, TYPE=C3D4, ELSET=REGION_",
                                   0);
        meshio__write_inp_elements(w, &kinds[1], &groups[1], owners,
                                   m->second_order ? "*ELEMENT, TYPE=S6, ELSET=SURFACE_"
                                                   : "*ELEMENT, TYPE=S3, ELSET=SURFACE_",
                                   m->num_tets);
        meshio__write_inp_surfaces(w, &groups[1], owners);
        memset(stamps, 0, (n + 1) * sizeof *stamps);
        meshio__write_inp_node_sets(w, &kinds[1], &groups[1], "*NSET, NSET=NODES_", stamps);
        memset(stamps, 0, (n + 1) * sizeof *stamps);
        meshio__write_inp_node_sets(w, &kinds[0], &groups[0], "*NSET, NSET=LINE_", stamps);
    }
    for (k = 0; k < 3; k++) MESHIO_FREE(groups[k].pairs);
    MESHIO_FREE(owners);
    MESHIO_FREE(sorted);
    MESHIO_FREE(stamps);
    return ok ? MESHIO_OK : MESHIO_ERROR_OUT_OF_MEMORY;
}

static void meshio__write_node(meshio__writer *w, const meshio_mesh *m)
{
    size_t i;
    meshio__printf(w, "%llu 3 0 1\n", (unsigned long long)m->num_vertices);
    for (i = 0; i < m->num_vertices; i++) {
        meshio__put_int(w, (int64_t)i + 1, ' ');
        meshio__put_xyz(w, m->xyz + 3 * i);
        meshio__put_int(w, m->vertex_tags ? m->vertex_tags[i] : 0, '\n');
    }
}

static void meshio__write_tetgen_cells(meshio__writer *w, const meshio__kind *kind)
{
    size_t i;
    int c;
    meshio__printf(w, kind->corners == 4 ? "%llu 4 1\n" : "%llu 1\n",
                   (unsigned long long)kind->num);
    for (i = 0; i < kind->num; i++) {
        meshio__put_int(w, (int64_t)i + 1, ' ');
        for (c = 0; c < kind->corners; c++)
            meshio__put_int(w, (int64_t)kind->v[i * (size_t)kind->corners + (size_t)c] + 1, ' ');
        meshio__put_int(w, kind->tags ? kind->tags[i] : 0, '\n');
    }
}

/* The unit normal of triangle t, or the zero vector if it has none. */
static void meshio__normal(const meshio_mesh *m, size_t t, double normal[3])
{
    const double *a = m->xyz + 3 * (size_t)m->triangles[3 * t];
    const double *b = m->xyz + 3 * (size_t)m->triangles[3 * t + 1];
    const double *c = m->xyz + 3 * (size_t)m->triangles[3 * t + 2];
    double length;
    int k;
    for (k = 0; k < 3; k++) {
        int y = (k + 1) % 3, z = (k + 2) % 3;
        normal[k] = (b[y] - a[y]) * (c[z] - a[z]) - (b[z] - a[z]) * (c[y] - a[y]);
    }
    length = sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
    for (k = 0; k < 3; k++) normal[k] = length > 0 ? normal[k] / length : 0;
}

static void meshio__write_stl(meshio__writer *w, const meshio_mesh *m, int ascii)
{
    char header[80];
    size_t t;
    int k, c;
    memset(header, 0, sizeof header);
    memcpy(header, "binary STL", 10);
    if (ascii) {
        meshio__printf(w, "solid %s\n", m->name);
    } else {
        meshio__put(w, header, 80);
        meshio__put_little(w, (uint32_t)m->num_triangles);
    }
    for (t = 0; t < m->num_triangles; t++) {
        double normal[3];
        meshio__normal(m, t, normal);
        if (ascii) {
            meshio__printf(w, "facet normal %.9g %.9g %.9g\nouter loop\n", normal[0], normal[1],
                           normal[2]);
            for (k = 0; k < 3; k++) {
                meshio__puts(w, "vertex ");
                meshio__put_xyz(w, m->xyz + 3 * (size_t)m->triangles[3 * t + (size_t)k]);
                meshio__puts(w, "\n");
            }
            meshio__puts(w, "endloop\nendfacet\n");
            continue;
        }
        for (k = 0; k < 12; k++) {
            float x;
            uint32_t bits;
            c = k % 3;
            x = (float)(k < 3 ? normal[c]
                              : m->xyz[3 * (size_t)m->triangles[3 * t + (size_t)(k / 3 - 1)] +
                                       (size_t)c]);
            memcpy(&bits, &x, 4);
            meshio__put_little(w, bits);
        }
        meshio__put_raw(w, 0, 1, 0);
        meshio__put_raw(w, 0, 1, 0);
    }
    if (ascii) meshio__printf(w, "endsolid %s\n", m->name);
}

static void meshio__write_off(meshio__writer *w, const meshio_mesh *m, int obj)
{
    size_t i;
    if (!obj)
        meshio__printf(w, "OFF\n%llu %llu 0\n", (unsigned long long)m->num_vertices,
                       (unsigned long long)m->num_triangles);
    for (i = 0; i < m->num_vertices; i++) {
        if (obj) meshio__puts(w, "v ");
        meshio__put_double(w, m->xyz[3 * i], ' ');
        meshio__put_double(w, m->xyz[3 * i + 1], ' ');
        meshio__put_double(w, m->xyz[3 * i + 2], '\n');
    }
    for (i = 0; i < m->num_triangles; i++) {
        meshio__puts(w, obj ? "f " : "3 ");
        meshio__put_int(w, (int64_t)m->triangles[3 * i] + obj, ' ');
        meshio__put_int(w, (int64_t)m->triangles[3 * i + 1] + obj, ' ');
        meshio__put_int(w, (int64_t)m->triangles[3 * i + 2] + obj, '\n');
    }
}

static void meshio__write_sizes(meshio__writer *w, int sol, const double *values, size_t count)
{
    size_t i;
    if (sol) meshio__puts(w, "MeshVersionFormatted 2\n\nDimension 3\n\nSolAtVertices\n");
    meshio__printf(w, sol ? "%llu\n1 1\n" : "%llu 1\n", (unsigned long long)count);
    for (i = 0; i < count; i++) meshio__put_double(w, values[i], '\n');
    if (sol) meshio__puts(w, "\nEnd\n");
}

/* ---- >>public -------------------------------------------------------------------------------- */

MESHIO_API const char *meshio_result_string(meshio_result result)
{
    switch (result) {
    case MESHIO_OK: return "ok";
    case MESHIO_ERROR_INVALID_ARGUMENT: return "invalid argument";
    case MESHIO_ERROR_OUT_OF_MEMORY: return "out of memory";
    case MESHIO_ERROR_TOO_LARGE: return "too large";
    case MESHIO_ERROR_OPEN: return "cannot open the file";
    case MESHIO_ERROR_READ: return "cannot read the file";
    case MESHIO_ERROR_FORMAT: return "not a file of this format";
    case MESHIO_ERROR_UNSUPPORTED: return "unsupported variant of the format";
    case MESHIO_ERROR_SYNTAX: return "syntax error";
    case MESHIO_ERROR_TRUNCATED: return "the file ends early";
    case MESHIO_ERROR_COUNT: return "impossible count";
    case MESHIO_ERROR_INDEX: return "a vertex that does not exist";
    case MESHIO_ERROR_WRITE: return "cannot write the file";
    }
    return "unknown status";
}

MESHIO_API meshio_format meshio_format_of(const char *path)
{
    static const struct {
        const char *extension;
        meshio_format format;
    } formats[] = {{"stl", MESHIO_FORMAT_STL},     {"off", MESHIO_FORMAT_OFF},
                   {"obj", MESHIO_FORMAT_OBJ},     {"ply", MESHIO_FORMAT_PLY},
                   {"mesh", MESHIO_FORMAT_MEDIT},  {"meshb", MESHIO_FORMAT_MEDIT_BINARY},
                   {"msh", MESHIO_FORMAT_MSH},     {"msh2", MESHIO_FORMAT_MSH},
                   {"msh4", MESHIO_FORMAT_MSH4},   {"vtk", MESHIO_FORMAT_VTK},
                   {"vtu", MESHIO_FORMAT_VTU},     {"inp", MESHIO_FORMAT_INP},
                   {"node", MESHIO_FORMAT_NODE},   {"ele", MESHIO_FORMAT_ELE},
                   {"poly", MESHIO_FORMAT_POLY},   {"smesh", MESHIO_FORMAT_SMESH},
                   {"xyz", MESHIO_FORMAT_XYZ},     {"bin", MESHIO_FORMAT_BIN}};
    const char *dot = path ? strrchr(path, '.') : NULL;
    size_t i;
    if (!dot) return MESHIO_FORMAT_AUTO;
    for (i = 0; i < sizeof formats / sizeof formats[0]; i++)
        if (meshio__same((const unsigned char *)dot + 1, strlen(dot + 1), formats[i].extension))
            return formats[i].format;
    return MESHIO_FORMAT_AUTO;
}

MESHIO_API int meshio_holds_tetrahedra(meshio_format format)
{
    return format == MESHIO_FORMAT_MEDIT || format == MESHIO_FORMAT_MEDIT_BINARY ||
           format == MESHIO_FORMAT_MSH || format == MESHIO_FORMAT_MSH4 ||
           format == MESHIO_FORMAT_VTU || format == MESHIO_FORMAT_VTK ||
           format == MESHIO_FORMAT_INP || format == MESHIO_FORMAT_ELE;
}

MESHIO_API int meshio_holds_triangles(meshio_format format)
{
    return meshio_holds_tetrahedra(format) || format == MESHIO_FORMAT_STL ||
           format == MESHIO_FORMAT_OFF || format == MESHIO_FORMAT_OBJ;
}

MESHIO_API void meshio_free(meshio_mesh *mesh)
{
    if (!mesh) return;
    MESHIO_FREE(mesh->xyz);
    MESHIO_FREE(mesh->vertex_tags);
    MESHIO_FREE(mesh->edges);
    MESHIO_FREE(mesh->edge_tags);
    MESHIO_FREE(mesh->triangles);
    MESHIO_FREE(mesh->triangle_tags);
    MESHIO_FREE(mesh->tets);
    MESHIO_FREE(mesh->tet_tags);
    MESHIO_FREE(mesh->holes);
    MESHIO_FREE(mesh->regions);
    MESHIO_FREE(mesh->spare);
    MESHIO_FREE(mesh->names);
    memset(mesh, 0, sizeof *mesh);
}

/* Loads the whole file into *bytes, with a zero after it. */
static meshio_result meshio__load(const char *path, unsigned char **bytes, size_t *size,
                                  meshio_report *report)
{
    FILE *file;
    void *data = NULL;
    size_t cap = 0, n = 0, got, wanted = 1 << 16;
    int error;
    *bytes = NULL;
    *size = 0;
#ifdef MESHIO__STAT
    {
        struct stat status;
        if (stat(path, &status) == 0) {
            if (S_ISDIR(status.st_mode))
                return meshio__report_plain(report, MESHIO_ERROR_OPEN, "cannot read", path, EISDIR);
            if (S_ISREG(status.st_mode) && status.st_size > 0) wanted = (size_t)status.st_size + 1;
        }
    }
#endif
    file = fopen(path, "rb");
    if (!file) return meshio__report_plain(report, MESHIO_ERROR_OPEN, "cannot open", path, errno);
    do {
        if (!meshio__reserve(&data, &cap, n + wanted + 1, 1)) {
            fclose(file);
            MESHIO_FREE(data);
            return meshio__report_plain(report, MESHIO_ERROR_OUT_OF_MEMORY,
                                        "out of memory while loading", path, 0);
        }
        got = fread((char *)data + n, 1, cap - n - 1, file);
        n += got;
        wanted = 1 << 16;
    } while (got > 0 && !feof(file));
    error = ferror(file) ? errno : 0;
    fclose(file);
    if (error) {
        MESHIO_FREE(data);
        return meshio__report_plain(report, MESHIO_ERROR_READ, "cannot read", path, error);
    }
    *bytes = (unsigned char *)data;
    (*bytes)[n] = 0;
    *size = n;
    return MESHIO_OK;
}

/* Puts the cursor on the beginning of a file, after a UTF-8 byte order mark. */
static void meshio__aim(meshio__reader *r, const unsigned char *bytes, size_t size)
{
    r->begin = r->p = bytes;
    r->end = bytes + size;
    r->text = r->comment = r->swap = 0;
    r->aside = NULL;
    if (size >= 3 && bytes[0] == 0xEF && bytes[1] == 0xBB && bytes[2] == 0xBF) r->p += 3;
}

static meshio_result meshio__read_any(meshio__reader *r, meshio_format format, int64_t first,
                                      meshio__loops *loops)
{
    switch (format) {
    case MESHIO_FORMAT_STL: return meshio__read_stl(r);
    case MESHIO_FORMAT_OFF: return meshio__read_off(r);
    case MESHIO_FORMAT_OBJ: return meshio__read_obj(r);
    case MESHIO_FORMAT_PLY: return meshio__read_ply(r);
    case MESHIO_FORMAT_MEDIT: return meshio__read_medit(r);
    case MESHIO_FORMAT_MEDIT_BINARY: return meshio__read_medit_binary(r);
    case MESHIO_FORMAT_MSH:
    case MESHIO_FORMAT_MSH4: return meshio__read_msh(r);
    case MESHIO_FORMAT_VTK: return meshio__read_vtk(r);
    case MESHIO_FORMAT_VTU: return meshio__read_vtu(r);
    case MESHIO_FORMAT_INP: return meshio__read_inp(r);
    case MESHIO_FORMAT_NODE: return meshio__read_node(r);
    case MESHIO_FORMAT_ELE: return meshio__read_elements(r, first);
    case MESHIO_FORMAT_POLY: return meshio__read_poly(r, 1, first, loops);
    case MESHIO_FORMAT_SMESH: return meshio__read_poly(r, 0, first, loops);
    case MESHIO_FORMAT_XYZ: return meshio__read_xyz(r);
    case MESHIO_FORMAT_BIN: return meshio__read_bin(r);
    case MESHIO_FORMAT_AUTO: break;
    }
    return meshio__fail(r, MESHIO_ERROR_INVALID_ARGUMENT, r->p, "no format");
}

static void meshio__reader_release(meshio__reader *r)
{
    MESHIO_FREE(r->polygon.data);
    MESHIO_FREE(r->table.data);
    MESHIO_FREE(r->scratch.data);
    MESHIO_FREE(r->ids.data);
    MESHIO_FREE(r->entities.data);
    MESHIO_FREE(r->grouped.data);
    MESHIO_FREE(r->spare.data);
    MESHIO_FREE(r->polygons.data);
    MESHIO_FREE(r->cells.corners.data);
    MESHIO_FREE(r->cells.ends.data);
    MESHIO_FREE(r->cells.types.data);
    MESHIO_FREE(r->cells.tags.data);
    MESHIO_FREE(r->decoded);
    MESHIO_FREE(r->packed);
}

/* The number of the first node in a .node file in memory: 0 or 1. */
static int64_t meshio__first_node(const unsigned char *bytes, size_t size)
{
    meshio__reader r;
    meshio_report report;
    int64_t first = 1;
    memset(&r, 0, sizeof r);
    r.report = &report;
    meshio__aim(&r, bytes, size);
    r.comment = '#';
    if (meshio__int(&r, &first) != MESHIO_OK) return 1;
    meshio__next_line(&r);
    if (meshio__int(&r, &first) != MESHIO_OK) return 1;
    return first == 0 ? 0 : 1;
}

/* Copies a path with another extension into `name`; 0 if it is too long. */
static int meshio__beside(const char *path, const char *extension, char *name, size_t size)
{
    const char *dot = strrchr(path, '.');
    size_t stem = dot && !strpbrk(dot, "/\\") ? (size_t)(dot - path) : strlen(path);
    if (stem + strlen(extension) + 1 > size) return 0;
    memcpy(name, path, stem);
    strcpy(name + stem, extension);
    return 1;
}

/* A file in memory; bytes NULL: none. */
typedef struct meshio__file {
    unsigned char *bytes;
    size_t size;
} meshio__file;

/* The file that is read, and those beside it that belong to it in TetGen's formats. */
enum { MESHIO__ITSELF, MESHIO__NODES, MESHIO__FACES, MESHIO__FILES };

/* Reads one of the files. Where that of the nodes or the faces is wrong, the message names it. */
static meshio_result meshio__read_file(meshio__reader *r, const meshio__file *files, int which,
                                       meshio_format format, meshio__loops *loops)
{
    static const char *const extensions[MESHIO__FILES] = {"", ".node", ".face"};
    const meshio__file *nodes = &files[MESHIO__NODES];
    int64_t first = nodes->bytes ? meshio__first_node(nodes->bytes, nodes->size) : 1;
    char message[sizeof r->report->message];
    meshio_result result;
    if (!files[which].bytes) return MESHIO_OK;
    meshio__aim(r, files[which].bytes, files[which].size);
    switch (which) {
    case MESHIO__NODES: result = meshio__read_node(r); break;
    case MESHIO__FACES: result = meshio__read_faces(r, first, r->spare.num > 0); break;
    default: return meshio__read_any(r, format, first, loops);
    }
    if (result == MESHIO_OK) return result;
    memcpy(message, r->report->message, sizeof message);
    snprintf(r->report->message, sizeof message, "the %s file beside it, %.280s",
             extensions[which], message);
    return result;
}

/* Reads a file, and those beside it, from memory. */
static meshio_result meshio__read(const meshio__file *files, meshio_format format,
                                  meshio_mesh *mesh, meshio_report *report)
{
    static const int order[MESHIO__FILES] = {MESHIO__NODES, MESHIO__ITSELF, MESHIO__FACES};
    meshio__reader r;
    meshio__loops loops;
    meshio_result result = MESHIO_OK;
    int k;
    memset(&r, 0, sizeof r);
    memset(&loops, 0, sizeof loops);
    r.mesh = mesh;
    r.report = report;
    for (k = 0; k < MESHIO__FILES && result == MESHIO_OK; k++)
        result = meshio__read_file(&r, files, order[k], format, &loops);
    if (result == MESHIO_OK) result = meshio__cut_polygons(&r);
    if (result == MESHIO_OK) result = meshio__find_spare(&r);
    meshio__reader_release(&r);
    MESHIO_FREE(loops.corners.data);
    MESHIO_FREE(loops.ends.data);
    MESHIO_FREE(loops.holes);
    return result;
}

MESHIO_API meshio_result meshio_read_memory(const void *bytes, size_t size, meshio_format format,
                                            meshio_mesh *mesh, meshio_report *report)
{
    meshio_report unused;
    meshio_result result;
    meshio__file files[MESHIO__FILES];
    if (!report) report = &unused;
    memset(report, 0, sizeof *report);
    if (!mesh || (!bytes && size))
        return meshio__report_words(report, MESHIO_ERROR_INVALID_ARGUMENT,
                                    "the bytes or the mesh are NULL");
    if (size == (size_t)-1)
        return meshio__report_words(report, MESHIO_ERROR_INVALID_ARGUMENT,
                                    "a size that no memory has");
    memset(mesh, 0, sizeof *mesh);
    memset(files, 0, sizeof files);
    files[MESHIO__ITSELF].size = size;
    files[MESHIO__ITSELF].bytes =
        (unsigned char *)MESHIO_MALLOC(size + 1); /* the cursor needs a zero after the end */
    if (!files[MESHIO__ITSELF].bytes)
        return meshio__report_words(report, MESHIO_ERROR_OUT_OF_MEMORY, "out of memory");
    if (size) memcpy(files[MESHIO__ITSELF].bytes, bytes, size);
    files[MESHIO__ITSELF].bytes[size] = 0;
    result = meshio__read(files, format, mesh, report);
    MESHIO_FREE(files[MESHIO__ITSELF].bytes);
    if (result != MESHIO_OK) meshio_free(mesh);
    return result;
}

/* Does a file of TetGen's need the .node file beside it? A .poly or .smesh file does if it lists no
 * nodes. */
static int meshio__needs_nodes(const meshio__file *file, meshio_format format)
{
    meshio__reader r;
    meshio_report unused;
    int64_t count = 1;
    if (format != MESHIO_FORMAT_POLY && format != MESHIO_FORMAT_SMESH)
        return format == MESHIO_FORMAT_ELE;
    memset(&r, 0, sizeof r);
    r.report = &unused;
    meshio__aim(&r, file->bytes, file->size);
    r.comment = '#';
    return meshio__int(&r, &count) == MESHIO_OK && count == 0;
}

/* Loads a file, and those beside it that belong to it. */
static meshio_result meshio__load_all(const char *path, meshio_format format, meshio__file *files,
                                      meshio_report *report)
{
    char name[1024];
    meshio__file *faces = &files[MESHIO__FACES], *nodes = &files[MESHIO__NODES];
    meshio__file *file = &files[MESHIO__ITSELF];
    meshio_result result;
    MESHIO__TRY(meshio__load(path, &file->bytes, &file->size, report));
    if (!meshio__needs_nodes(file, format)) return MESHIO_OK;
    if (!meshio__beside(path, ".node", name, sizeof name))
        return meshio__report_plain(report, MESHIO_ERROR_OPEN, "the name is too long:", path, 0);
    MESHIO__TRY(meshio__load(name, &nodes->bytes, &nodes->size, report));
    if (format != MESHIO_FORMAT_ELE || !meshio__beside(path, ".face", name, sizeof name))
        return MESHIO_OK;
    result = meshio__load(name, &faces->bytes, &faces->size, report);
    if (result != MESHIO_ERROR_OPEN) return result;
    memset(report, 0, sizeof *report); /* the faces may be missing */
    return MESHIO_OK;
}

MESHIO_API meshio_result meshio_read(const char *path, meshio_format format, meshio_mesh *mesh,
                                     meshio_report *report)
{
    meshio_report unused;
    meshio_result result;
    meshio__file files[MESHIO__FILES];
    int k;
    if (!report) report = &unused;
    memset(report, 0, sizeof *report);
    if (!path || !mesh)
        return meshio__report_words(report, MESHIO_ERROR_INVALID_ARGUMENT,
                                    "the path or the mesh is NULL");
    memset(mesh, 0, sizeof *mesh);
    memset(files, 0, sizeof files);
    if (format == MESHIO_FORMAT_AUTO) format = meshio_format_of(path);
    if (format == MESHIO_FORMAT_AUTO)
        return meshio__report_plain(report, MESHIO_ERROR_FORMAT, "unknown extension of", path, 0);
    result = meshio__load_all(path, format, files, report);
    if (result == MESHIO_OK) result = meshio__read(files, format, mesh, report);
    for (k = 0; k < MESHIO__FILES; k++) MESHIO_FREE(files[k].bytes);
    if (result != MESHIO_OK) meshio_free(mesh);
    return result;
}

/* Clears the report and looks at the arguments of a function for sizes; *sol: is the file one of
 * Medit's, not TetGen's? */
static meshio_result meshio__sizes_file(const char *path, const double *values, size_t count,
                                        int *sol, meshio_report *report)
{
    const char *dot = path ? strrchr(path, '.') : NULL;
    memset(report, 0, sizeof *report);
    if (!path || (!values && count))
        return meshio__report_words(report, MESHIO_ERROR_INVALID_ARGUMENT,
                                    "the path or the array is NULL");
    *sol = dot && meshio__same((const unsigned char *)dot, strlen(dot), ".sol");
    if (*sol || (dot && meshio__same((const unsigned char *)dot, strlen(dot), ".mtr")))
        return MESHIO_OK;
    return meshio__report_plain(report, MESHIO_ERROR_FORMAT, "unknown extension of", path, 0);
}

MESHIO_API meshio_result meshio_read_sizes(const char *path, double *values, size_t count,
                                           meshio_report *report)
{
    meshio_report unused;
    meshio_result result;
    meshio__reader r;
    unsigned char *bytes;
    size_t size;
    int sol;
    if (!report) report = &unused;
    MESHIO__TRY(meshio__sizes_file(path, values, count, &sol, report));
    MESHIO__TRY(meshio__load(path, &bytes, &size, report));
    memset(&r, 0, sizeof r);
    r.report = report;
    meshio__aim(&r, bytes, size);
    result = meshio__read_sizes(&r, sol, values, count);
    MESHIO_FREE(bytes);
    return result;
}

MESHIO_API meshio_result meshio_write_sizes(const char *path, const double *values, size_t count,
                                            meshio_report *report)
{
    meshio_report unused;
    meshio_result result;
    meshio__writer *w;
    int sol;
    if (!report) report = &unused;
    MESHIO__TRY(meshio__sizes_file(path, values, count, &sol, report));
    w = (meshio__writer *)MESHIO_MALLOC(sizeof *w);
    if (!w) return meshio__report_words(report, MESHIO_ERROR_OUT_OF_MEMORY, "out of memory");
    result = meshio__create(w, path, report);
    if (result == MESHIO_OK) {
        meshio__write_sizes(w, sol, values, count);
        result = meshio__complete(w, MESHIO_OK, report);
    }
    MESHIO_FREE(w);
    return result;
}

/* Writes one of the TetGen files. */
static meshio_result meshio__write_tetgen(meshio__writer *w, const char *path,
                                          const meshio_mesh *mesh, const char *extension,
                                          meshio_report *report)
{
    const char *slash = strrchr(path, '/');
    char name[1024];
    meshio__kind kinds[3];
    meshio__kinds(mesh, kinds);
    if (!meshio__beside(path, extension, name, sizeof name))
        return meshio__report_plain(report, MESHIO_ERROR_WRITE, "the name is too long:", path, 0);
    if (!strchr(slash ? slash : path, '.') && meshio__is_device(path))
        return meshio__report_plain(report, MESHIO_ERROR_WRITE,
                                    "a format with a file for each kind cannot be written to", path,
                                    0);
    MESHIO__TRY(meshio__create(w, name, report));
    if (strcmp(extension, ".node") == 0)
        meshio__write_node(w, mesh);
    else
        meshio__write_tetgen_cells(w, &kinds[strcmp(extension, ".ele") == 0 ? 2 : 1]);
    return meshio__complete(w, MESHIO_OK, report);
}

/* Do the mesh's counts and indices fit in the integers of the format? Those of 32 bits are signed,
 * but for the number of triangles in STL files. */
static int meshio__counts_fit(const meshio_mesh *m, meshio_format format,
                              const meshio_write_options *options)
{
    const uint64_t most = 0x7FFFFFFF;
    switch (format) {
    case MESHIO_FORMAT_MEDIT_BINARY:
        return m->num_vertices <= most && m->num_edges <= most && m->num_triangles <= most &&
               m->num_tets <= most;
    case MESHIO_FORMAT_MSH: /* elements are numbered across the kinds */
        return !options->binary ||
               (m->num_vertices <= most && m->num_edges <= most && m->num_triangles <= most &&
                m->num_tets <= most &&
                (uint64_t)m->num_edges + m->num_triangles + m->num_tets <= most);
    case MESHIO_FORMAT_VTK: return !options->binary || m->num_vertices <= most;
    case MESHIO_FORMAT_STL: return options->ascii || (uint64_t)m->num_triangles <= 0xFFFFFFFFu;
    default: return 1;
    }
}

/* Are the corners of all triangles within the range of single precision? */
static int meshio__is_single(const meshio_mesh *mesh)
{
    size_t i;
    int k;
    for (i = 0; i < 3 * (size_t)mesh->num_triangles; i++)
        for (k = 0; k < 3; k++)
            if (fabs(mesh->xyz[3 * (size_t)mesh->triangles[i] + (size_t)k]) > FLT_MAX) return 0;
    return 1;
}

/* Can the names of the fields be written? */
static int meshio__names_fit(const meshio_write_options *options)
{
    size_t f, n;
    for (f = 0; f < (size_t)options->num_fields; f++) {
        const char *name = options->fields[f].name;
        for (n = 0; name && name[n]; n++)
            if ((unsigned char)name[n] <= ' ' || name[n] == 127 || strchr("\"&<>", name[n]))
                return 0;
        if (n == 0 || n > 100) return 0;
    }
    return 1;
}

static meshio_result meshio__write(meshio__writer *w, const char *path, const meshio_mesh *mesh,
                                   const meshio_write_options *options, meshio_report *report)
{
    meshio_format format = options->format ? options->format : meshio_format_of(path);
    meshio_result result = MESHIO_OK;
    if (format == MESHIO_FORMAT_NODE) return meshio__write_tetgen(w, path, mesh, ".node", report);
    if (format == MESHIO_FORMAT_ELE && !mesh->second_order) {
        MESHIO__TRY(meshio__write_tetgen(w, path, mesh, ".node", report));
        /* also if there are no triangles: the .face file of another mesh may exist */
        MESHIO__TRY(meshio__write_tetgen(w, path, mesh, ".face", report));
        return meshio__write_tetgen(w, path, mesh, ".ele", report);
    }
    if (!meshio_holds_triangles(format))
        return meshio__report_plain(report, MESHIO_ERROR_FORMAT, "no writer for the format of",
                                    path, 0);
    if (!meshio__names_fit(options))
        return meshio__report_words(report, MESHIO_ERROR_INVALID_ARGUMENT,
                                    "the name of a field is empty, too long or cannot be written");
    if (mesh->second_order && format != MESHIO_FORMAT_MSH && format != MESHIO_FORMAT_VTU &&
        format != MESHIO_FORMAT_INP)
        return meshio__report_plain(report, MESHIO_ERROR_FORMAT,
                                    "no second-order elements in the format of", path, 0);
    if (format == MESHIO_FORMAT_STL && !options->ascii && !meshio__is_single(mesh))
        return meshio__report_plain(report, MESHIO_ERROR_TOO_LARGE,
                                    "a coordinate is too large for the single precision of", path,
                                    0);
    if (!meshio__counts_fit(mesh, format, options))
        return meshio__report_plain(report, MESHIO_ERROR_TOO_LARGE,
                                    "more vertices or elements than the format can number:", path,
                                    0);
    MESHIO__TRY(meshio__create(w, path, report));
    switch (format) {
    case MESHIO_FORMAT_MEDIT: meshio__write_medit(w, mesh); break;
    case MESHIO_FORMAT_MEDIT_BINARY: meshio__write_medit_binary(w, mesh); break;
    case MESHIO_FORMAT_MSH: meshio__write_msh2(w, mesh, options->binary); break;
    case MESHIO_FORMAT_MSH4: result = meshio__write_msh4(w, mesh, options->binary); break;
    case MESHIO_FORMAT_INP: result = meshio__write_inp(w, mesh); break;
    case MESHIO_FORMAT_VTU: meshio__write_vtu(w, mesh, options); break;
    case MESHIO_FORMAT_VTK: meshio__write_vtk(w, mesh, options); break;
    case MESHIO_FORMAT_STL: meshio__write_stl(w, mesh, options->ascii); break;
    default: meshio__write_off(w, mesh, format == MESHIO_FORMAT_OBJ); break;
    }
    return meshio__complete(w, result, report);
}

MESHIO_API meshio_result meshio_write(const char *path, const meshio_mesh *mesh,
                                      const meshio_write_options *options, meshio_report *report)
{
    meshio_report unused;
    meshio_write_options defaults;
    meshio_result result;
    meshio__writer *w;
    if (!report) report = &unused;
    memset(report, 0, sizeof *report);
    memset(&defaults, 0, sizeof defaults);
    if (!path || !mesh)
        return meshio__report_words(report, MESHIO_ERROR_INVALID_ARGUMENT,
                                    "the path or the mesh is NULL");
    w = (meshio__writer *)MESHIO_MALLOC(sizeof *w);
    if (!w) return meshio__report_words(report, MESHIO_ERROR_OUT_OF_MEMORY, "out of memory");
    if (!options) options = &defaults;
    w->threads = options->num_threads;
    result = meshio__write(w, path, mesh, options, report);
    MESHIO_FREE(w);
    return result;
}

#endif /* MESHIO_IMPLEMENTATION */

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
