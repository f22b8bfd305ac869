/* mesh.c - from a surface file to an improved mesh, compared with gmsh's HXT and TetGen
 *
 *     make bench-mesh                  three surfaces that the program makes itself
 *     make bench-mesh MODELS=FOLDER    also the .off .stl .obj .ply files in and below a folder
 *     build/bench_mesh [--threads N].. [--runs K] [--case NAME].. [--size-factor F] [--peak]
 *                      [FILE ..]
 *
 * Cases: fibres100 (a cube with 100 fibres, each a region), cad (the part of examples/demo_part.h,
 * finer), scan (a bumpy sphere with irregular triangles). All meshers get the same file and run in
 * turns; the best of K runs (default 3) counts. Each program reports its own seconds: ours from
 * reading to improvement (without writing, and without the final proof of examples/mesh.c, which is
 * not meshing); HXT the sum of its phases, without reading; TetGen its total. NAME-refine: seconds
 * of refinement for each vertex that it inserts. gmsh runs with -algo hxt and improves up to gamma
 * 0.35; TetGen runs with the switches of [Marot 2020, 7]. A rival that is not installed is named.
 * --peak adds lines with the bytes that our refinement needs for each tetrahedron. --size-factor F
 * makes our sizes F times as large; with 1, we and HXT make about as many tetrahedra.
 *
 * CSV: bench,case,threads,ours_s,rival,rival_s,ratio; lines with # give counts and phases.
 */
#define MESHER_IMPLEMENTATION
#include "mesher.h"
#define SPR_IMPLEMENTATION
#include "spr.h"
#define MESHIO_IMPLEMENTATION
#include "meshio.h"
#include "demo_part.h"
#include "tool.h"

enum { MAX_LIST = 32, MAX_FIBRES = 100 };

typedef struct timing {
    double refine, per_vertex, total, bytes_per_tet;
    unsigned long tets, added;
    int valid;
} timing;

typedef struct bench {
    int threads[MAX_LIST], num_threads, runs, has_gmsh, has_tetgen, peak;
    const char *cases[MAX_LIST];
    int num_cases;
    double size_factor;
    char folder[200];
} bench;

/* ---- surfaces ---- */

static uint64_t random_state = 1;

static double uniform(double low, double high)
{
    random_state = random_state * 6364136223846793005u + 1442695040888963407u;
    return low + (high - low) * (double)(random_state >> 11) / 9007199254740992.0;
}

typedef struct surface {
    meshio_mesh mesh;
    size_t cap_vertices, cap_triangles;
} surface;

static void *grow(void *block, size_t bytes)
{
    void *more = realloc(block, bytes);
    if (!more) {
        fprintf(stderr, "bench_mesh: out of memory\n");
        exit(1);
    }
    return more;
}

static uint32_t add_vertex(surface *s, double x, double y, double z)
{
    double *p;
    if (s->mesh.num_vertices == s->cap_vertices) {
        s->cap_vertices = 2 * s->cap_vertices + 1024;
        s->mesh.xyz = (double *)grow(s->mesh.xyz, s->cap_vertices * 3 * sizeof(double));
    }
    p = s->mesh.xyz + 3 * s->mesh.num_vertices;
    p[0] = x;
    p[1] = y;
    p[2] = z;
    return (uint32_t)s->mesh.num_vertices++;
}

static void add_triangle(surface *s, uint32_t a, uint32_t b, uint32_t c, int tag)
{
    uint32_t *t;
    if (s->mesh.num_triangles == s->cap_triangles) {
        s->cap_triangles = 2 * s->cap_triangles + 1024;
        s->mesh.triangles =
            (uint32_t *)grow(s->mesh.triangles, s->cap_triangles * 3 * sizeof(uint32_t));
        s->mesh.triangle_tags =
            (int32_t *)grow(s->mesh.triangle_tags, s->cap_triangles * sizeof(int32_t));
    }
    t = s->mesh.triangles + 3 * s->mesh.num_triangles;
    t[0] = a;
    t[1] = b;
    t[2] = c;
    s->mesh.triangle_tags[s->mesh.num_triangles++] = tag;
}

/* The unit cube, n squares along an edge. */
static void add_cube(surface *s, int n, int tag)
{
    uint32_t *id =
        (uint32_t *)grow(NULL, (size_t)(n + 1) * (size_t)(n + 1) * (size_t)(n + 1) * sizeof *id);
    int axis, side, i, j, k;
    for (i = 0; i < (n + 1) * (n + 1) * (n + 1); i++) id[i] = UINT32_MAX;
    for (axis = 0; axis < 3; axis++)
        for (side = 0; side < 2; side++)
            for (i = 0; i < n; i++)
                for (j = 0; j < n; j++) {
                    uint32_t v[4];
                    for (k = 0; k < 4; k++) {
                        int at[3];
                        uint32_t *slot;
                        at[axis] = side * n;
                        at[(axis + 1) % 3] = i + (k == 1 || k == 2);
                        at[(axis + 2) % 3] = j + (k >= 2);
                        slot = id + (at[0] * (n + 1) + at[1]) * (n + 1) + at[2];
                        if (*slot == UINT32_MAX)
                            *slot = add_vertex(s, (double)at[0] / n, (double)at[1] / n,
                                               (double)at[2] / n);
                        v[side ? k : 3 - k] = *slot;
                    }
                    k = (i + j) & 1;
                    add_triangle(s, v[k], v[k + 1], v[k + 2], tag);
                    add_triangle(s, v[k], v[k + 2], v[(k + 3) & 3], tag);
                }
    free(id);
}

typedef struct fibre {
    double a[3], axis[3], length, radius;
} fibre;

/* Distance of two segments, from below: by samples, less what may lie between them. */
static int fibres_meet(const fibre *f, const fibre *g)
{
    enum { SAMPLES = 64 };
    double room = f->radius + g->radius + 0.02, step = g->length / SAMPLES;
    int i, k;
    for (i = 0; i <= SAMPLES; i++) {
        double d[3], along = 0, dd = 0;
        for (k = 0; k < 3; k++) {
            d[k] = g->a[k] + i * step * g->axis[k] - f->a[k];
            along += d[k] * f->axis[k];
        }
        along = along < 0 ? 0 : along > f->length ? f->length : along;
        for (k = 0; k < 3; k++) dd += (d[k] - along * f->axis[k]) * (d[k] - along * f->axis[k]);
        if (dd < (room + step / 2) * (room + step / 2)) return 1;
    }
    return 0;
}

static fibre random_fibre(void)
{
    for (;;) {
        fibre f;
        double l = 0;
        int k, inside = 1;
        for (k = 0; k < 3; k++) {
            f.a[k] = uniform(0.06, 0.94);
            f.axis[k] = uniform(-1, 1);
            l += f.axis[k] * f.axis[k];
        }
        if (l > 1 || l < 0.01) continue;
        f.length = uniform(0.15, 0.45);
        f.radius = uniform(0.012, 0.022);
        for (k = 0; k < 3; k++) {
            double end;
            f.axis[k] /= sqrt(l);
            end = f.a[k] + f.length * f.axis[k];
            inside = inside && end > 0.06 && end < 0.94;
        }
        if (inside) return f;
    }
}

/* A disc of hexagonal rings, around from point offset on; the vertices of its rim are given. */
static void add_cap(surface *s, const fibre *f, double u[3][3], double at, int rings,
                    const uint32_t *rim, int flip, int tag)
{
    uint32_t inner[64], outer[64];
    int ring, i, k, turn = 6 * rings;
    double c[3];
    for (k = 0; k < 3; k++) c[k] = f->a[k] + at * f->axis[k];
    inner[0] = add_vertex(s, c[0], c[1], c[2]);
    for (ring = 1; ring <= rings; ring++) {
        int n = 6 * ring;
        for (i = 0; i < n; i++) {
            double angle = demo_part_turn * i / n, r = f->radius * ring / rings, x[3];
            for (k = 0; k < 3; k++) x[k] = c[k] + r * (cos(angle) * u[0][k] + sin(angle) * u[1][k]);
            outer[i] = ring == rings ? rim[i % turn] : add_vertex(s, x[0], x[1], x[2]);
        }
        for (i = 0; i < n; i++) { /* side q of the hexagon, place j on it */
            int q = i / ring, j = i % ring, m = ring > 1 ? 6 * (ring - 1) : 1;
            uint32_t a = outer[i], b = outer[(i + 1) % n], p = inner[(q * (ring - 1) + j) % m];
            if (flip) add_triangle(s, a, p, b, tag);
            else add_triangle(s, a, b, p, tag);
            if (j == 0) continue;
            b = inner[(q * (ring - 1) + j - 1) % m];
            if (flip) add_triangle(s, a, b, p, tag);
            else add_triangle(s, a, p, b, tag);
        }
        memcpy(inner, outer, sizeof inner);
    }
}

static void add_fibre(surface *s, const fibre *f, int tag)
{
    enum { RINGS = 2, AROUND = 6 * RINGS };
    double u[3][3], l = 0;
    uint32_t row[2][AROUND], first[AROUND];
    int least = 0, n, i, j, k;
    for (k = 1; k < 3; k++)
        if (fabs(f->axis[k]) < fabs(f->axis[least])) least = k;
    for (k = 0; k < 3; k++) u[0][k] = (k == least) - f->axis[k] * f->axis[least];
    for (k = 0; k < 3; k++) l += u[0][k] * u[0][k];
    for (k = 0; k < 3; k++) u[0][k] /= sqrt(l);
    for (k = 0; k < 3; k++)
        u[1][k] =
            f->axis[(k + 1) % 3] * u[0][(k + 2) % 3] - f->axis[(k + 2) % 3] * u[0][(k + 1) % 3];
    n = (int)(f->length * AROUND / (demo_part_turn * f->radius * 0.866)) / 2 *
        2; /* even: the last row as the first */
    for (j = 0; j <= n; j++) {
        for (i = 0; i < AROUND; i++) {
            double angle = demo_part_turn * (i + 0.5 * (j & 1)) / AROUND, x[3];
            for (k = 0; k < 3; k++)
                x[k] = f->a[k] + f->length * j / n * f->axis[k] +
                       f->radius * (cos(angle) * u[0][k] + sin(angle) * u[1][k]);
            row[j & 1][i] = add_vertex(s, x[0], x[1], x[2]);
        }
        if (j == 0) memcpy(first, row[0], sizeof first);
        for (i = 0; j > 0 && i < AROUND; i++) {
            int next = (i + 1) % AROUND;
            const uint32_t *low = row[(j + 1) & 1], *high = row[j & 1];
            if (j & 1) {
                add_triangle(s, low[i], low[next], high[i], tag);
                add_triangle(s, high[i], low[next], high[next], tag);
            } else {
                add_triangle(s, low[i], high[next], high[i], tag);
                add_triangle(s, low[i], low[next], high[next], tag);
            }
        }
    }
    add_cap(s, f, u, 0, RINGS, first, 1, tag);
    add_cap(s, f, u, f->length, RINGS, row[0], 0, tag);
}

/* A cube with fibres that do not touch: tag 1 and a tag for each fibre. */
static void make_fibres(surface *s)
{
    static fibre fibres[MAX_FIBRES];
    int n = 0, i;
    random_state = 2020;
    add_cube(s, 40, 1);
    while (n < MAX_FIBRES) {
        fibre f = random_fibre();
        for (i = 0; i < n && !fibres_meet(&fibres[i], &f); i++) {}
        if (i < n) continue;
        fibres[n++] = f;
        add_fibre(s, &f, n + 1);
    }
}

/* A bumpy ball: a subdivided octahedron, its points moved about on the sphere and along the
 * radius. */
static void make_scan(surface *s)
{
    enum { N = 112 };
    static uint32_t id[2 * N + 1][2 * N + 1][2];
    int i, j, k, side;
    random_state = 7;
    for (i = -N; i <= N; i++) /* |x| + |y| + |z| = N, seen from above and below */
        for (j = -N; j <= N; j++)
            for (side = 0; side < 2; side++) {
                double x[3], l = 0, r;
                if (abs(i) + abs(j) > N) continue;
                if (side && abs(i) + abs(j) == N) {
                    id[i + N][j + N][1] = id[i + N][j + N][0];
                    continue;
                }
                x[0] = i + uniform(-0.3, 0.3);
                x[1] = j + uniform(-0.3, 0.3);
                x[2] = (N - abs(i) - abs(j)) * (side ? -1 : 1) + uniform(-0.3, 0.3);
                for (k = 0; k < 3; k++) l += x[k] * x[k];
                for (k = 0; k < 3; k++) x[k] /= sqrt(l);
                r = 1 + 0.1 * sin(5 * x[0] + 1) * sin(4 * x[1]) +
                    0.05 * sin(11 * x[2]) * cos(9 * x[0]) +
                    0.02 * sin(23 * x[1] + 2) * sin(27 * x[2]) + uniform(-0.0015, 0.0015);
                id[i + N][j + N][side] = add_vertex(s, r * x[0], r * x[1], r * x[2]);
            }
    for (i = -N; i < N; i++)
        for (j = -N; j < N; j++)
            for (side = 0; side < 2; side++) {
                uint32_t v[4];
                int corner[4],
                    in = 0,
                    diagonal = i < 0 ? j < 0 : j >= 0; /* along the sides of the octahedron */
                for (k = 0; k < 4; k++) {
                    int x = i + (k == 1 || k == 2), y = j + (k >= 2);
                    corner[k] = abs(x) + abs(y) <= N;
                    in += corner[k];
                    v[k] = corner[k] ? id[x + N][y + N][side] : 0;
                }
                for (k = 0; k < 2 && in >= 3; k++) {
                    int a = diagonal ? 1 + 2 * k : 2 * k, b = (a + 1) & 3, c = (a + 2) & 3;
                    if (!corner[a] || !corner[b] || !corner[c]) continue;
                    if (side) add_triangle(s, v[a], v[c], v[b], 1);
                    else add_triangle(s, v[a], v[b], v[c], 1);
                }
            }
}

/* ---- ours ---- */

static int run_ours(const bench *b, const char *path, int threads, timing *t)
{
    meshio_mesh in;
    meshio_report io;
    mesher_surface given;
    mesher_options options;
    mesher_report report;
    mesher_domain domain;
    spr_options improve;
    spr_report improved;
    double start = tool_seconds(), middle;
    memset(t, 0, sizeof *t);
    memset(&given, 0, sizeof given);
    memset(&options, 0, sizeof options);
    memset(&report, 0, sizeof report);
    memset(&improve, 0, sizeof improve);
    if (meshio_read(path, MESHIO_FORMAT_AUTO, &in, &io) != MESHIO_OK) {
        fprintf(stderr, "%s: %s\n", path, io.message);
        return 0;
    }
    given.xyz = in.xyz;
    given.num_vertices = in.num_vertices;
    given.triangles = in.triangles;
    given.num_triangles = in.num_triangles;
    options.size_factor = b->size_factor;
    options.host.num_threads = improve.host.num_threads = threads;
    if (mesher_mesh(&domain, &given, &options, &report) < 0) {
        fprintf(stderr, "%s: %s\n", path, report.message);
        meshio_free(&in);
        return 0;
    }
    middle = tool_seconds();
    t->valid = spr_improve(&domain.mesh, &improve, &improved) >= 0;
    t->total = tool_seconds() - start;
    t->refine = report.seconds_refine;
    t->added = (unsigned long)report.refined_vertices;
    t->per_vertex = t->added ? t->refine / (double)t->added : 0;
    t->tets = (unsigned long)report.num_tets;
    t->bytes_per_tet = report.num_tets ? (double)report.peak_bytes / (double)report.num_tets : 0;
    printf(
        "# %s ours %d threads: empty %.3f recover %.3f refine %.3f improve %.3f; "
        "%lu vertices added, %lu tets, edge/size %.2f %.2f %.2f, %.1f %% in band; "
        "below 0.35: %lu, then %lu\n",
        path, threads, report.seconds_empty, report.seconds_recover, t->refine,
        t->total - (middle - start), t->added, t->tets, report.size_p10, report.size_p50,
        report.size_p90, 100 * report.size_in_band, (unsigned long)improved.before.num_below,
        (unsigned long)improved.after.num_below);
    mesher_domain_free(&domain);
    meshio_free(&in);
    return t->valid;
}

/* ---- rivals ---- */

static int run_command(const char *command) { return system(command) == 0; }

/* The last number on the last line of a file that contains a word; 0 if there is none. */
static double number_after(const char *path, const char *word)
{
    char line[1000];
    double found = 0;
    FILE *f = fopen(path, "r");
    if (!f) return 0;
    while (fgets(line, sizeof line, f)) {
        const char *at = strstr(line, word);
        if (at) at = strpbrk(at + strlen(word), "0123456789");
        if (at) found = strtod(at, NULL);
    }
    fclose(f);
    return found;
}

/* One surface for each tag: closed, so that each is a loop; the first one contains the others. */
static int write_for_gmsh(const bench *b, const meshio_mesh *m)
{
    char path[300];
    FILE *f;
    size_t i;
    int tags = 1, k;
    snprintf(path, sizeof path, "%s/s.msh", b->folder);
    f = fopen(path, "w");
    if (!f) return 0;
    fprintf(f, "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n%lu\n",
            (unsigned long)m->num_vertices);
    for (i = 0; i < m->num_vertices; i++)
        fprintf(f, "%lu %.17g %.17g %.17g\n", (unsigned long)i + 1, m->xyz[3 * i],
                m->xyz[3 * i + 1], m->xyz[3 * i + 2]);
    fprintf(f, "$EndNodes\n$Elements\n%lu\n", (unsigned long)m->num_triangles);
    for (i = 0; i < m->num_triangles; i++) {
        int tag = m->triangle_tags[i] > 0 ? m->triangle_tags[i] : 1;
        const uint32_t *v = m->triangles + 3 * i;
        if (tag > tags) tags = tag;
        fprintf(f, "%lu 2 2 %d %d %lu %lu %lu\n", (unsigned long)i + 1, tag, tag, v[0] + 1ul,
                v[1] + 1ul, v[2] + 1ul);
    }
    fprintf(f, "$EndElements\n");
    if (fclose(f)) return 0;
    snprintf(path, sizeof path, "%s/s.geo", b->folder);
    f = fopen(path, "w");
    if (!f) return 0;
    fprintf(f, "Merge \"s.msh\";\n");
    for (k = 1; k <= tags; k++) fprintf(f, "Surface Loop(%d) = {%d};\n", k, k);
    fprintf(f, "Volume(1) = {1");
    for (k = 2; k <= tags; k++) fprintf(f, ", %d", k);
    fprintf(f, "};\n");
    for (k = 2; k <= tags; k++) fprintf(f, "Volume(%d) = {%d};\n", k, k);
    return fclose(f) == 0;
}

static int run_gmsh(const bench *b, const char *path, int threads, size_t num_vertices, timing *t)
{
    static const char *const phases[6] = {"tEmptyMesh",   "tVerifyBnd", "tBndRecovery",
                                          "tConvertMesh", "tRefine",    "tOptimize"};
    char command[1000], log[300];
    int k;
    memset(t, 0, sizeof *t);
    snprintf(log, sizeof log, "%s/gmsh.log", b->folder);
    snprintf(
        command, sizeof command,
        "timeout 600 gmsh -3 %s/s.geo -algo hxt -nt %d -v 4 -setnumber Mesh.OptimizeThreshold 0.35 "
        "-format mesh -save_all -o %s/g.mesh > %s 2>&1 < /dev/null",
        b->folder, threads, b->folder, log);
    if (!run_command(command)) return 0;
    for (k = 0; k < 6; k++) t->total += number_after(log, phases[k]);
    t->refine = number_after(log, "tRefine");
    /* the last two such lines: tetrahedra, then vertices */
    snprintf(command, sizeof command,
             "sed -n 's/.*mesh contains \\([0-9]*\\) vertices.*/vertices \\1/p; "
             "s/.*mesh contains \\([0-9]*\\) tetrahedra.*/tetrahedra \\1/p' %s > %s/counts",
             log, b->folder);
    if (!run_command(command)) return 0;
    snprintf(command, sizeof command, "%s/counts", b->folder);
    t->tets = (unsigned long)number_after(command, "tetrahedra");
    t->added = (unsigned long)number_after(command, "vertices");
    t->added = t->added > num_vertices ? t->added - (unsigned long)num_vertices : 0;
    t->per_vertex = t->added ? t->refine / (double)t->added : 0;
    t->valid = t->total > 0 && t->tets > 0;
    printf(
        "# %s hxt %d threads: empty %.3f recover %.3f refine %.3f improve %.3f; "
        "%lu vertices added, %lu tets (with those outside)\n",
        path, threads, number_after(log, phases[0]),
        number_after(log, phases[1]) + number_after(log, phases[2]), t->refine,
        number_after(log, phases[5]), t->added, t->tets);
    return t->valid;
}

static int run_tetgen(const bench *b, const char *path, timing *t)
{
    char command[700], log[300];
    memset(t, 0, sizeof *t);
    snprintf(log, sizeof log, "%s/tetgen.log", b->folder);
    snprintf(command, sizeof command,
             "timeout 600 tetgen -BNEFIVVYp -q1.1/14 -O7 -o/130 %s/t.off > %s 2>&1 < /dev/null",
             b->folder, log);
    if (!run_command(command)) return 0;
    t->total = number_after(log, "Total running seconds");
    t->tets = (unsigned long)number_after(log, "Mesh tetrahedra");
    t->valid = t->total > 0;
    printf("# %s tetgen: total %.3f; %lu tets\n", path, t->total, t->tets);
    return t->valid;
}

/* ---- the table ---- */

static int wanted(const bench *b, const char *name)
{
    int i;
    for (i = 0; i < b->num_cases; i++)
        if (strcmp(b->cases[i], name) == 0) return 1;
    return b->num_cases == 0;
}

static void row(const char *name, const char *what, int threads, double ours, const char *rival,
                double other)
{
    if (ours > 0 && other > 0)
        printf("mesh,%s-%s,%d,%.6g,%s,%.6g,%.3f\n", name, what, threads, ours, rival, other,
               other / ours);
    else printf("mesh,%s-%s,%d,%.6g,%s,failed,\n", name, what, threads, ours, rival);
    fflush(stdout);
}

static void keep_best(timing *best, const timing *t, int first)
{
    if (!t->valid) return;
    if (first || !best->valid) {
        *best = *t;
        return;
    }
    if (t->total < best->total) best->total = t->total;
    if (t->per_vertex < best->per_vertex) best->per_vertex = t->per_vertex;
}

static void run_case(const bench *b, const char *name, const char *path)
{
    meshio_mesh m;
    meshio_report io;
    meshio_write_options off;
    char copy[300];
    timing ours[MAX_LIST], hxt[MAX_LIST], tetgen, t;
    int i, k;
    memset(&tetgen, 0, sizeof tetgen);
    memset(ours, 0, sizeof ours);
    memset(hxt, 0, sizeof hxt);
    memset(&off, 0, sizeof off);
    off.format = MESHIO_FORMAT_OFF;
    snprintf(copy, sizeof copy, "%s/t.off", b->folder);
    if (meshio_read(path, MESHIO_FORMAT_AUTO, &m, &io) != MESHIO_OK || !write_for_gmsh(b, &m) ||
        meshio_write(copy, &m, &off, &io) != MESHIO_OK) {
        fprintf(stderr, "%s: cannot be read or copied\n", path);
        return;
    }
    printf("# %s: %lu vertices, %lu triangles\n", name, (unsigned long)m.num_vertices,
           (unsigned long)m.num_triangles);
    for (k = 0; k < b->runs; k++) {
        for (i = 0; i < b->num_threads; i++) {
            if (run_ours(b, path, b->threads[i], &t)) keep_best(&ours[i], &t, k == 0);
            if (b->has_gmsh && run_gmsh(b, path, b->threads[i], m.num_vertices, &t))
                keep_best(&hxt[i], &t, k == 0);
        }
        if (b->has_tetgen && run_tetgen(b, path, &t)) keep_best(&tetgen, &t, k == 0);
    }
    for (i = 0; i < b->num_threads; i++) {
        int n = b->threads[i];
        if (b->has_gmsh) row(name, "refine", n, ours[i].per_vertex, "hxt", hxt[i].per_vertex);
        if (n > 1 && b->threads[0] == 1)
            row(name, "refine", n, ours[i].per_vertex, "ours_1t", ours[0].per_vertex);
        if (b->has_gmsh) row(name, "total", n, ours[i].total, "hxt", hxt[i].total);
        if (n > 1 && b->threads[0] == 1)
            row(name, "total", n, ours[i].total, "ours_1t", ours[0].total);
        if (n == 1 && b->has_tetgen) row(name, "total", n, ours[i].total, "tetgen", tetgen.total);
        if (b->peak)
            printf("# %s %d threads: %.1f bytes a tetrahedron at the peak\n", name, n,
                   ours[i].bytes_per_tet);
    }
    meshio_free(&m);
}

static void run_made(const bench *b, const char *name, void (*make)(surface *))
{
    surface s;
    meshio_report io;
    char path[300];
    if (!wanted(b, name)) return;
    memset(&s, 0, sizeof s);
    if (make) make(&s);
    else if (!demo_part_make(&s.mesh, 2)) return;
    if (!make) memset(s.mesh.triangle_tags, 0, s.mesh.num_triangles * sizeof *s.mesh.triangle_tags);
    snprintf(path, sizeof path, "%s/%s.msh", b->folder, name);
    if (meshio_write(path, &s.mesh, NULL, &io) != MESHIO_OK)
        fprintf(stderr, "bench_mesh: %s\n", io.message);
    else run_case(b, name, path);
    remove(path);
    meshio_free(&s.mesh);
}

static int is_installed(const char *program)
{
    char command[100];
    snprintf(command, sizeof command, "command -v %s > /dev/null 2>&1", program);
    if (run_command(command)) return 1;
    printf("# %s is not installed: its rows are missing\n", program);
    return 0;
}

static void run_files(const bench *b, int argc, char **argv)
{
    char name[64];
    int i;
    for (i = 1; i < argc; i++) {
        const char *slash = strrchr(argv[i], '/'), *dot;
        if (argv[i][0] == '-') {
            i += strcmp(argv[i], "--peak") != 0;
            continue;
        }
        slash = slash ? slash + 1 : argv[i];
        dot = strrchr(slash, '.');
        snprintf(name, sizeof name, "%.*s", dot ? (int)(dot - slash) : 60, slash);
        run_case(b, name, argv[i]);
    }
}

int main(int argc, char **argv)
{
    static bench b;
    char command[300];
    const char *base = getenv("TMPDIR");
    int i;
    b.runs = 3;
    for (i = 1; i < argc; i++) {
        double v;
        if (strcmp(argv[i], "--peak") == 0) b.peak = 1;
        else if (argv[i][0] != '-') continue;
        else if (strcmp(argv[i], "--threads") == 0 && b.num_threads < MAX_LIST &&
                 tool_number(argv[i + 1], 1, 4096, &v))
            b.threads[b.num_threads++] = (int)v;
        else if (strcmp(argv[i], "--runs") == 0 && tool_number(argv[i + 1], 1, 100, &v))
            b.runs = (int)v;
        else if (strcmp(argv[i], "--size-factor") == 0 && tool_number(argv[i + 1], 0.1, 10, &v))
            b.size_factor = v;
        else if (strcmp(argv[i], "--case") == 0 && b.num_cases < MAX_LIST && argv[i + 1])
            b.cases[b.num_cases++] = argv[i + 1];
        else {
            fprintf(stderr,
                    "usage: bench_mesh [--threads N].. [--runs K] [--case NAME].. "
                    "[--size-factor F] [--peak] [FILE ..]\n");
            return 2;
        }
        i += argv[i][0] == '-' && strcmp(argv[i], "--peak") != 0;
    }
    if (b.num_threads == 0) {
        b.threads[b.num_threads++] = 1;
        b.threads[b.num_threads++] = 2;
    }
    snprintf(b.folder, sizeof b.folder, "%.150s/bench_mesh.%ld", base ? base : "/tmp",
             (long)getpid());
    snprintf(command, sizeof command, "mkdir -p '%s'", b.folder);
    if (!run_command(command)) return 1;
    printf("bench,case,threads,ours_s,rival,rival_s,ratio\n");
    b.has_gmsh = is_installed("gmsh");
    b.has_tetgen = is_installed("tetgen");
    run_made(&b, "fibres100", make_fibres);
    run_made(&b, "cad", NULL);
    run_made(&b, "scan", make_scan);
    run_files(&b, argc, argv);
    snprintf(command, sizeof command, "rm -rf '%s'", b.folder);
    return run_command(command) ? 0 : 1;
}
