/* recovery.c - time of boundary recovery, compared with the times that TetGen and HXT print for it,
 * on surfaces that the program makes
 *
 *     make bench-recovery [ARGS="SCALE"]      SCALE 1: about 50 000 triangles each (default),
 *                                             3: about 500 000
 *
 * CSV: bench,case,triangles,threads,ours_s,rival,rival_s,ratio. Ours: all of mesher_recover, the
 * best of three runs; TetGen: 'Boundary recovery seconds' with -BNEFIVVYp; HXT: tBndRecovery of
 * gmsh -algo hxt; one thread each. A rival that is not installed is named, without numbers. Lines
 * "detect" have the microseconds per tetrahedron of the search for missing edges and facets. Files
 * go into build/recovery.tmp. */
#define MESHER_IMPLEMENTATION
#include "mesher.h"
#define MESHIO_IMPLEMENTATION
#include "meshio.h"
#include "demo_part.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define FOLDER "build/recovery.tmp"

/* -- surfaces; tag 1: outside, 2: what is within */

typedef struct surface {
    double *xyz;
    uint32_t *triangles;
    int32_t *tags;
    size_t num_vertices, num_triangles, cap_vertices, cap_triangles;
} surface;

static void *grown(void *block, size_t size)
{
    block = realloc(block, size);
    if (!block) exit(1);
    return block;
}

static uint32_t vertex(surface *s, double x, double y, double z)
{
    double *p;
    if (s->num_vertices == s->cap_vertices) {
        s->cap_vertices = 2 * s->cap_vertices + 1000;
        s->xyz = (double *)grown(s->xyz, 3 * s->cap_vertices * sizeof *s->xyz);
    }
    p = s->xyz + 3 * s->num_vertices;
    p[0] = x;
    p[1] = y;
    p[2] = z;
    return (uint32_t)s->num_vertices++;
}

static void triangle(surface *s, uint32_t a, uint32_t b, uint32_t c, int tag)
{
    uint32_t *t;
    if (s->num_triangles == s->cap_triangles) {
        s->cap_triangles = 2 * s->cap_triangles + 1000;
        s->triangles = (uint32_t *)grown(s->triangles, 3 * s->cap_triangles * sizeof *s->triangles);
        s->tags = (int32_t *)grown(s->tags, s->cap_triangles * sizeof *s->tags);
    }
    t = s->triangles + 3 * s->num_triangles;
    t[0] = a;
    t[1] = b;
    t[2] = c;
    s->tags[s->num_triangles++] = tag;
}

static uint64_t state = 88172645463325252u;
static double unit(void)
{
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return (double)(state >> 11) / 9007199254740992.0;
}

/* A cylinder of n by m quads along an axis, closed by fans. */
static void fibre(surface *s, const double *foot, int axis, double length, double radius,
                  uint32_t n, uint32_t m)
{
    uint32_t first = (uint32_t)s->num_vertices, i, j, end[2];
    double x[3];
    for (j = 0; j <= m; j++)
        for (i = 0; i < n; i++) {
            double t = demo_part_turn * (i + 0.5 * (j % 2)) / n;
            x[axis] = foot[axis] + length * j / m;
            x[(axis + 1) % 3] = foot[(axis + 1) % 3] + radius * cos(t);
            x[(axis + 2) % 3] = foot[(axis + 2) % 3] + radius * sin(t);
            vertex(s, x[0], x[1], x[2]);
        }
    memcpy(x, foot, sizeof x);
    end[0] = vertex(s, x[0], x[1], x[2]);
    x[axis] += length;
    end[1] = vertex(s, x[0], x[1], x[2]);
    for (i = 0; i < n; i++) {
        triangle(s, end[0], first + (i + 1) % n, first + i, 2);
        triangle(s, end[1], first + m * n + i, first + m * n + (i + 1) % n, 2);
    }
    for (j = 0; j < m; j++)
        for (i = 0; i < n; i++) {
            uint32_t a = first + j * n + i, b = first + j * n + (i + 1) % n;
            triangle(s, a, b, j % 2 ? b + n : a + n, 2);
            triangle(s, b, b + n, j % 2 ? a : a + n, 2);
            if (j % 2) { /* the diagonal is a to b + n: the second triangle is a, b + n, a + n */
                uint32_t *t = s->triangles + 3 * (s->num_triangles - 1);
                t[0] = a;
                t[1] = b + n;
                t[2] = a + n;
            }
        }
}

/* Layers of thin fibres in a cube, neighbours a quarter of a radius apart. */
static void fibres(surface *s, double scale)
{
    uint32_t around = (uint32_t)(8 * scale), along = 60, each = (uint32_t)(7 * scale), i, l, k;
    double radius = 0.4 / each, lo[3] = {0, 0, 0};
    uint32_t v[8];
    static const uint8_t faces[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6},
                                         {0, 1, 4}, {1, 5, 4}, {2, 6, 3}, {3, 6, 7},
                                         {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    for (i = 0; i < 8; i++) v[i] = vertex(s, i & 1, i >> 1 & 1, i >> 2);
    for (i = 0; i < 12; i++) triangle(s, v[faces[i][0]], v[faces[i][1]], v[faces[i][2]], 1);
    for (l = 0; l < each; l++)
        for (i = 0; i < each; i++) {
            k = l % 2;
            lo[k] = 0.05;
            lo[1 - k] = (i + 0.5) / each;
            lo[2] = (l + 0.5) / each;
            fibre(s, lo, (int)k, 0.9, radius, around < 6 ? 6 : around, along);
        }
}

static void part(surface *s, double scale)
{
    meshio_mesh mesh;
    size_t i;
    memset(&mesh, 0, sizeof mesh);
    if (!demo_part_make(&mesh, scale < 2 ? 1 : (int)scale)) exit(1);
    for (i = 0; i < mesh.num_vertices; i++)
        vertex(s, mesh.xyz[3 * i], mesh.xyz[3 * i + 1], mesh.xyz[3 * i + 2]);
    for (i = 0; i < mesh.num_triangles; i++)
        triangle(s, mesh.triangles[3 * i], mesh.triangles[3 * i + 1], mesh.triangles[3 * i + 2], 1);
    meshio_free(&mesh);
}

/* A ball of bumps and noise, such as a scanner sees it: rings of points, shaken, star-shaped. */
static void scan(surface *s, double scale)
{
    uint32_t n = (uint32_t)(112 * scale), m = 2 * n, i, j, top, bottom;
    for (j = 1; j < n; j++)
        for (i = 0; i < m; i++) {
            double a = demo_part_turn / 2 * (j + 0.2 * (unit() - 0.5)) / n;
            double b = demo_part_turn * (i + 0.5 * (j % 2) + 0.2 * (unit() - 0.5)) / m;
            double r =
                1 + 0.1 * sin(7 * a) * cos(9 * b) + 0.05 * sin(23 * b + 5 * a) + 0.4 / n * unit();
            vertex(s, r * sin(a) * cos(b), r * sin(a) * sin(b), r * cos(a));
        }
    top = vertex(s, 0, 0, 1);
    bottom = vertex(s, 0, 0, -1);
    for (i = 0; i < m; i++) {
        triangle(s, top, i, (i + 1) % m, 1);
        triangle(s, bottom, (n - 2) * m + (i + 1) % m, (n - 2) * m + i, 1);
        for (j = 0; j + 2 < n; j++) {
            uint32_t a = j * m + i, b = j * m + (i + 1) % m, c = a + m, d = b + m;
            if (j % 2) { /* rows are half a step apart */
                triangle(s, a, d, b, 1);
                triangle(s, a, c, d, 1);
            } else {
                triangle(s, a, c, b, 1);
                triangle(s, b, c, d, 1);
            }
        }
    }
}

/* -- ours */

static double ours(const surface *s, int threads, double *detect)
{
    mesher_surface in;
    mesher_options options;
    double best = HUGE_VAL;
    int run;
    memset(&in, 0, sizeof in);
    memset(&options, 0, sizeof options);
    in.xyz = s->xyz;
    in.num_vertices = s->num_vertices;
    in.triangles = s->triangles;
    in.num_triangles = s->num_triangles;
    options.host.num_threads = threads;
    for (run = 0; run < 3; run++) {
        mesher_domain domain;
        mesher_report report;
        mesher_result result;
        memset(&report, 0, sizeof report);
        result = mesher_domain_init(&domain, &in, &options, &report);
        if (result == MESHER_OK) result = mesher_empty_mesh(&domain, &report);
        if (result == MESHER_OK) result = mesher_recover(&domain, &report);
        if (result != MESHER_OK) fprintf(stderr, "recovery: %s\n", report.message);
        if (result == MESHER_OK && report.seconds_recover < best) best = report.seconds_recover;
        if (result == MESHER_OK && run == 0)
            fprintf(stderr, "# %lu edges, %lu facets missing, %lu points\n",
                    (unsigned long)report.missing_edges, (unsigned long)report.missing_facets,
                    (unsigned long)report.interior_steiner);
        *detect = report.seconds_detect * 1e6 / (double)(domain.mesh.num_tets + 1);
        mesher_domain_free(&domain);
    }
    return best;
}

/* -- rivals: files, a run, and a number from what they print */

static void write_off(const surface *s, const char *path)
{
    FILE *f = fopen(path, "w");
    size_t i;
    if (!f) exit(1);
    fprintf(f, "OFF\n%lu %lu 0\n", (unsigned long)s->num_vertices, (unsigned long)s->num_triangles);
    for (i = 0; i < s->num_vertices; i++)
        fprintf(f, "%.17g %.17g %.17g\n", s->xyz[3 * i], s->xyz[3 * i + 1], s->xyz[3 * i + 2]);
    for (i = 0; i < s->num_triangles; i++)
        fprintf(f, "3 %u %u %u\n", s->triangles[3 * i], s->triangles[3 * i + 1],
                s->triangles[3 * i + 2]);
    fclose(f);
}

static void write_msh(const surface *s, const char *path, const char *geo)
{
    FILE *f = fopen(path, "w"), *g = fopen(geo, "w");
    size_t i;
    int within = s->tags[s->num_triangles - 1] == 2;
    if (!f || !g) exit(1);
    fprintf(f, "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n%lu\n",
            (unsigned long)s->num_vertices);
    for (i = 0; i < s->num_vertices; i++)
        fprintf(f, "%lu %.17g %.17g %.17g\n", (unsigned long)(i + 1), s->xyz[3 * i],
                s->xyz[3 * i + 1], s->xyz[3 * i + 2]);
    fprintf(f, "$EndNodes\n$Elements\n%lu\n", (unsigned long)s->num_triangles);
    for (i = 0; i < s->num_triangles; i++)
        fprintf(f, "%lu 2 2 %d %d %u %u %u\n", (unsigned long)(i + 1), s->tags[i], s->tags[i],
                s->triangles[3 * i] + 1, s->triangles[3 * i + 1] + 1, s->triangles[3 * i + 2] + 1);
    fprintf(f, "$EndElements\n");
    fprintf(g, "Merge \"s.msh\";\nSurface Loop(1)={1};\n%s",
            within ? "Surface Loop(2)={2};\nVolume(1)={1,2};\n" : "Volume(1)={1};\n");
    fclose(f);
    fclose(g);
}

/* Runs a command; the number after a key in what it prints, or -1. */
static double printed(const char *command, const char *key)
{
    char line[512];
    double value = -1;
    FILE *f = popen(command, "r");
    if (!f) return -1;
    while (fgets(line, sizeof line, f)) {
        const char *at = strstr(line, key);
        if (at) value = atof(at + strlen(key) + strspn(at + strlen(key), " \t=:"));
    }
    return pclose(f) == 0 || value > 0 ? value : -1;
}

static int installed(const char *program)
{
    char command[100];
    snprintf(command, sizeof command, "command -v %s > /dev/null 2>&1", program);
    return system(command) == 0;
}

static void compare(const char *name, const surface *s, double one, const char *rival,
                    const char *command, const char *key)
{
    unsigned long n = (unsigned long)s->num_triangles;
    double seconds = installed(rival) ? printed(command, key) : -1;
    if (seconds >= 0)
        printf("recovery,%s,%lu,1,%.4f,%s,%.4f,%.2f\n", name, n, one, rival, seconds,
               seconds / one);
    else
        printf("recovery,%s,%lu,1,%.4f,%s,%s,\n", name, n, one, rival,
               installed(rival) ? "failed" : "missing");
    fflush(stdout);
}

static void run(const char *name, void (*make)(surface *, double), double scale)
{
    surface s;
    double one, two, detect;
    memset(&s, 0, sizeof s);
    make(&s, scale);
    two = ours(&s, 2, &detect);
    one = ours(&s, 1, &detect);
    printf("recovery,%s,%lu,2,%.4f,ours on 1,%.4f,%.2f\n", name, (unsigned long)s.num_triangles,
           two, one, one / two);
    printf("detect,%s,%lu,1,%.4f us per tetrahedron,,,\n", name, (unsigned long)s.num_triangles,
           detect);
    write_off(&s, FOLDER "/s.off");
    write_msh(&s, FOLDER "/s.msh", FOLDER "/s.geo");
    compare(name, &s, one, "tetgen", "timeout 300 tetgen -BNEFIVVYp " FOLDER "/s.off",
            "Boundary recovery seconds");
    compare(name, &s, one, "gmsh",
            "timeout 300 gmsh -3 " FOLDER "/s.geo -algo hxt -nt 1 -format mesh -o " FOLDER
            "/s.mesh -v 4 -setnumber Mesh.Optimize 0 2>&1",
            "tBndRecovery");
    free(s.xyz);
    free(s.triangles);
    free(s.tags);
}

int main(int argc, char **argv)
{
    double scale = argc > 1 ? atof(argv[1]) : 1;
    if (!(scale > 0 && scale <= 10) || system("mkdir -p " FOLDER) != 0) return 2;
    printf("bench,case,triangles,threads,ours_s,rival,rival_s,ratio\n");
    run("fibres", fibres, scale);
    run("part", part, scale);
    run("scan", scan, scale);
    return system("rm -r " FOLDER) != 0;
}
