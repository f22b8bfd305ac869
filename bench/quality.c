/* quality.c - an independent judge of tetrahedral meshes: build/bench_quality MESH ..
 *
 * Reads Medit ASCII and prints one CSV line: the measures as the textbooks define them, computed
 * here and not by the headers. Either orientation is accepted; a mesh with both has inverted
 * tetrahedra and negative measures. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct mesh {
    double *xyz;
    long   *tets, num_vertices, num_tets;
} mesh;

static int read_count(FILE *f, long *n)
{
    return fscanf(f, "%ld", n) == 1 && *n >= 0 && *n < 1000000000L;
}

static int read_mesh(FILE *f, mesh *m)
{
    char word[128];
    long i, n;
    int k;
    memset(m, 0, sizeof *m);
    while (fscanf(f, "%127s", word) == 1) {
        if (word[0] == '#') { /* to the end of the line */
            if (fscanf(f, "%*[^\n]") == EOF) break;
        } else if (!strcmp(word, "Vertices") && !m->xyz) {
            if (!read_count(f, &n)) return 0;
            m->num_vertices = n;
            m->xyz = (double *)malloc((size_t)(3 * n + 1) * sizeof *m->xyz);
            if (!m->xyz) return 0;
            for (i = 0; i < n; i++)
                if (fscanf(f, "%lf %lf %lf %*s", &m->xyz[3 * i], &m->xyz[3 * i + 1],
                           &m->xyz[3 * i + 2]) != 3)
                    return 0;
        } else if (!strcmp(word, "Tetrahedra") && !m->tets) {
            if (!read_count(f, &n)) return 0;
            m->num_tets = n;
            m->tets = (long *)malloc((size_t)(4 * n + 1) * sizeof *m->tets);
            if (!m->tets) return 0;
            for (i = 0; i < n; i++) {
                long *t = m->tets + 4 * i;
                if (fscanf(f, "%ld %ld %ld %ld %*s", t, t + 1, t + 2, t + 3) != 4) return 0;
                for (k = 0; k < 4; k++)
                    if (t[k] < 1 || t[k] > m->num_vertices) return 0;
            }
        }
    }
    return m->xyz && m->tets;
}

static double dot(const double *a, const double *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
static void cross(const double *a, const double *b, double *c)
{
    c[0] = a[1] * b[2] - a[2] * b[1];
    c[1] = a[2] * b[0] - a[0] * b[2];
    c[2] = a[0] * b[1] - a[1] * b[0];
}

typedef struct measures {
    double volume, gamma, sicn, smallest, largest;
} measures;

/* S maps the regular tetrahedron's edges to these: S = E W^-1; 3 / (|S| |S^-1|), signed. */
static double inverse_condition(double e[3][3])
{
    const double w[3][3] = {
        {1, -0.57735026918962576, -0.40824829046386302}, /* W^-1, W = (w1 w2 w3) by columns */
        {0, 1.1547005383792515, -0.40824829046386302},
        {0, 0, 1.2247448713915889}};
    double s[3][3], c[3][3], det, a = 0, b = 0;
    int i, j, k;
    for (i = 0; i < 3; i++) /* s[j] is column j */
        for (j = 0; j < 3; j++)
            for (k = 0, s[j][i] = 0; k < 3; k++) s[j][i] += e[k][i] * w[k][j];
    for (i = 0; i < 3; i++) cross(s[(i + 1) % 3], s[(i + 2) % 3], c[i]);
    det = dot(s[0], c[0]);
    for (i = 0; i < 3; i++) {
        a += dot(s[i], s[i]);
        b += dot(c[i], c[i]);
    }
    return a * b > 0 ? 3 * det / sqrt(a * b) : 0;
}

static measures measure(const mesh *m, const long *t)
{
    static const int opposite[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};
    double e[3][3], normal[4][3], area[4], longest = 0, sum = 0, c[3], angle;
    const double *p[4];
    measures r;
    int i, j, k;
    for (i = 0; i < 4; i++) p[i] = m->xyz + 3 * (t[i] - 1);
    for (i = 0; i < 3; i++)
        for (k = 0; k < 3; k++) e[i][k] = p[i + 1][k] - p[0][k];
    cross(e[0], e[1], c);
    r.volume = dot(c, e[2]) / 6;
    for (i = 0; i < 4; i++) {
        const double *a = p[opposite[i][0]], *b = p[opposite[i][1]], *d = p[opposite[i][2]];
        double u[3], v[3];
        for (k = 0; k < 3; k++) {
            u[k] = b[k] - a[k];
            v[k] = d[k] - a[k];
        }
        cross(u, v, normal[i]);
        area[i] = sqrt(dot(normal[i], normal[i])) / 2;
        sum += area[i];
        for (j = 0; j < i; j++) {
            for (k = 0; k < 3; k++) u[k] = p[i][k] - p[j][k];
            longest = fmax(longest, sqrt(dot(u, u)));
        }
    }
    r.gamma = sum > 0 ? sqrt(24.0) * (3 * r.volume / sum) / longest : 0; /* inradius = 3 V / A */
    r.sicn = inverse_condition(e);
    r.smallest = 180;
    r.largest = 0;
    for (i = 0; i < 4; i++)
        for (j = 0; j < i; j++) {
            cross(normal[i], normal[j], c);
            angle = 180 - atan2(sqrt(dot(c, c)), dot(normal[i], normal[j])) * 57.295779513082321;
            r.smallest = fmin(r.smallest, angle);
            r.largest = fmax(r.largest, angle);
        }
    return r;
}

static int compare(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

static int judge(const char *path)
{
    FILE *f = fopen(path, "r");
    mesh m;
    measures r;
    double *gamma, mean = 0, sicn = 1, smallest = 180, largest = 0, sign = 0;
    long i, below = 0, below30 = 0;
    if (!f || !read_mesh(f, &m) || m.num_tets == 0) {
        fprintf(stderr, "%s: cannot be read\n", path);
        if (f) fclose(f);
        return 1;
    }
    fclose(f);
    gamma = (double *)malloc((size_t)m.num_tets * sizeof *gamma);
    if (!gamma) return 1;
    for (i = 0; i < m.num_tets; i++) sign += measure(&m, m.tets + 4 * i).volume;
    sign = sign < 0 ? -1 : 1;
    for (i = 0; i < m.num_tets; i++) {
        r = measure(&m, m.tets + 4 * i);
        gamma[i] = sign * r.gamma;
        below += gamma[i] < 0.35;
        below30 += gamma[i] < 0.30;
        mean += gamma[i] / (double)m.num_tets;
        sicn = fmin(sicn, sign * r.sicn);
        smallest = fmin(smallest, r.smallest);
        largest = fmax(largest, r.largest);
    }
    qsort(gamma, (size_t)m.num_tets, sizeof *gamma, compare);
    printf("%ld,%.4g,%.4g,%.4g,%.4f,%ld,%ld,%.4g,%.2f,%.2f\n", m.num_tets, gamma[0],
           gamma[m.num_tets / 1000], gamma[m.num_tets / 100], mean, below, below30, sicn, smallest,
           largest);
    free(gamma);
    free(m.xyz);
    free(m.tets);
    return 0;
}

int main(int argc, char **argv)
{
    int i, failed = 0, header = 1;
    for (i = 1; i < argc; i++) {
        if (!strcmp(argv[i], "--no-header")) {
            header = 0;
            continue;
        }
        if (header)
            printf("tets,gamma_min,gamma_p001,gamma_p01,gamma_mean,below35,below30,sicn_min,"
                   "dihedral_min,dihedral_max\n");
        header = 0;
        failed |= judge(argv[i]);
    }
    return failed;
}
