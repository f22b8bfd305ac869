/* quality.c - an independent judge of tetrahedral meshes: build/bench_quality MESH ..
 *
 * Reads Medit ASCII files and prints one CSV line for each: the measures as textbooks define them,
 * computed here and not by the headers. Either orientation is accepted; a mesh with both has
 * inverted tetrahedra and negative measures.
 *
 * free35 counts the tetrahedra with gamma below 0.35 whose quality is not limited by the surface
 * (including interfaces between references). It limits one if no tetrahedron of gamma >= 0.35
 *   - fits on one of its facets on the surface, on the inner side of the adjacent surface facets;
 *   - fits between the two surface facets around one of its edges: the dihedral angle is too small;
 *   - fits into the solid angle that the surface leaves at one of its corners. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct mesh {
    double *xyz;
    long   *tets, *ref, num_vertices, num_tets;
    long   *behind; /* 4 a tetrahedron: 4*t+i of the same facet behind facet i, -1: surface */
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
            m->ref = (long *)malloc((size_t)(n + 1) * sizeof *m->ref);
            if (!m->tets || !m->ref) return 0;
            for (i = 0; i < n; i++) {
                long *t = m->tets + 4 * i;
                if (fscanf(f, "%ld %ld %ld %ld %ld", t, t + 1, t + 2, t + 3, m->ref + i) != 5)
                    return 0;
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

/* ---- what the surface allows ---------------------------------------------------------------- */

#define GOAL 0.35

typedef struct side {
    long v[3], at; /* sorted vertices; 4*t+i */
} side;

static int compare_sides(const void *a, const void *b)
{
    const side *x = (const side *)a, *y = (const side *)b;
    int k;
    for (k = 0; k < 3; k++)
        if (x->v[k] != y->v[k]) return x->v[k] < y->v[k] ? -1 : 1;
    return x->at < y->at ? -1 : x->at > y->at;
}

/* Finds what is behind each facet. */
static int link_tets(mesh *m)
{
    long n = 4 * m->num_tets, i, k;
    side *s = (side *)malloc((size_t)n * sizeof *s);
    m->behind = (long *)malloc((size_t)n * sizeof *m->behind);
    if (!s || !m->behind) {
        free(s);
        return 0;
    }
    for (i = 0; i < n; i++) {
        for (k = 0; k < 3; k++) s[i].v[k] = m->tets[4 * (i / 4) + (i + 1 + k) % 4];
        for (k = 0; k < 3; k++) { /* three exchanges sort three */
            long *p = s[i].v + k % 2, swap = p[0];
            if (p[0] <= p[1]) continue;
            p[0] = p[1];
            p[1] = swap;
        }
        s[i].at = i;
        m->behind[i] = -1;
    }
    qsort(s, (size_t)n, sizeof *s, compare_sides);
    for (i = 0; i + 1 < n; i++) {
        if (memcmp(s[i].v, s[i + 1].v, sizeof s[i].v)) continue;
        if (m->ref[s[i].at / 4] != m->ref[s[i + 1].at / 4]) continue;
        m->behind[s[i].at] = s[i + 1].at;
        m->behind[s[i + 1].at] = s[i].at;
    }
    free(s);
    return 1;
}

static const double *corner(const mesh *m, long t, int i)
{
    return m->xyz + 3 * (m->tets[4 * t + i] - 1);
}

static void minus(const double *a, const double *b, double *c)
{
    int k;
    for (k = 0; k < 3; k++) c[k] = a[k] - b[k];
}

static double gamma_of(const double *const *p)
{
    double longest = 0, area = 0, u[3], v[3], w[3], c[3], volume;
    int i, j;
    for (i = 0; i < 4; i++) {
        for (j = 0; j < i; j++) {
            minus(p[i], p[j], u);
            longest = fmax(longest, dot(u, u));
        }
        minus(p[(i + 2) % 4], p[(i + 1) % 4], u);
        minus(p[(i + 3) % 4], p[(i + 1) % 4], v);
        cross(u, v, c);
        area += sqrt(dot(c, c));
    }
    minus(p[0], p[1], w);
    minus(p[2], p[1], u);
    minus(p[3], p[1], v);
    cross(u, v, c);
    volume = fabs(dot(c, w));
    return area * longest > 0 ? sqrt(24.0) * volume / (area * sqrt(longest)) : 0;
}

/* Angle between the half planes from edge ab through c and through d, in radians. */
static double dihedral(const double *a, const double *b, const double *c, const double *d)
{
    double e[3], u[3], v[3], p[3], q[3], r[3];
    minus(b, a, e);
    minus(c, a, u);
    minus(d, a, v);
    cross(e, u, p);
    cross(e, v, q);
    cross(p, q, r);
    return atan2(sqrt(dot(r, r)), dot(p, q));
}

/* Of the corner p with edges to a, b, c. */
static double solid_angle(const double *p, const double *a, const double *b, const double *c)
{
    double u[3], v[3], w[3], n[3], l[3];
    minus(a, p, u);
    minus(b, p, v);
    minus(c, p, w);
    cross(v, w, n);
    l[0] = sqrt(dot(u, u));
    l[1] = sqrt(dot(v, v));
    l[2] = sqrt(dot(w, w));
    return 2 * fabs(atan2(fabs(dot(u, n)), l[0] * l[1] * l[2] + dot(u, v) * l[2] +
                                               dot(v, w) * l[0] + dot(w, u) * l[1]));
}

static double random_unit(unsigned long *state)
{
    *state = (*state * 1103515245ul + 12345ul) & 0x7ffffffful;
    return (double)*state / 1073741824.0 - 1;
}

/* The smallest dihedral (solid) angle of all tetrahedra with gamma GOAL: random steps that shrink,
 * from many starts. */
static double smallest_angle(int solid)
{
    double best = 7, x[12], y[12], value, least, step;
    unsigned long state = 1;
    const double *p[4];
    int start, tries, i;
    for (i = 0; i < 4; i++) p[i] = y + 3 * i;
    for (start = 0; start < 12; start++) {
        static const double regular[12] = {1, 1, 1, 1, -1, -1, -1, 1, -1, -1, -1, 1};
        least = 7;
        memcpy(x, regular, sizeof x);
        for (step = 0.5, tries = 0; tries < 20000; tries++) {
            for (i = 0; i < 12; i++) y[i] = x[i] + step * random_unit(&state);
            value = solid ? solid_angle(p[0], p[1], p[2], p[3]) : dihedral(p[0], p[1], p[2], p[3]);
            if (value < least && gamma_of(p) >= GOAL) {
                least = value;
                memcpy(x, y, sizeof x);
            } else if (tries % 50 == 49) step = step > 1e-4 ? step * 0.97 : step;
        }
        best = fmin(best, least);
    }
    return best;
}

/* Turns around the edge of t between facets i and j, leaving t by j, up to the surface; adds
 * angles; the surface facet met is 4*t+i of the result. */
static long turn(const mesh *m, long t, int i, int j, double *angle)
{
    long at = -1, first = t;
    *angle = 0;
    do {
        int a = 0, b, k;
        long next, other;
        while (a == i || a == j) a++;
        b = 6 - i - j - a;
        *angle += dihedral(corner(m, t, a), corner(m, t, b), corner(m, t, i), corner(m, t, j));
        at = 4 * t + j;
        next = m->behind[at];
        if (next < 0) return at;
        other = m->tets[4 * t + i]; /* lies on facet j: on the next one's facet it is opposite what
                                       we leave by */
        for (k = 0; m->tets[4 * (next / 4) + k] != other; k++) {}
        t = next / 4;
        i = (int)(next % 4);
        j = k;
    } while (t != first);
    return at; /* no surface here */
}

typedef struct limits {
    double dihedral, solid;
} limits;

/* Some apex on this side of the planes makes a tetrahedron as good as GOAL on facet i of t. */
static int facet_allows(const mesh *m, long t, int i)
{
    const double *p[4];
    double plane[3][6], q[3], here[3], angle, best = 0, step, size = 0, u[3], v[3];
    int planes = 0, e, k, tries, way, start;
    for (e = 0, k = 0; e < 4; e++)
        if (e != i) p[k++] = corner(m, t, e);
    for (e = 0; e < 4; e++) {
        long met;
        const double *o;
        if (e == i) continue;
        met = turn(m, t, i, e, &angle); /* around the edge that facets i and e share */
        if (angle >= 3.14159265) continue;
        o = corner(m, met / 4, (int)(met % 4));
        minus(corner(m, met / 4, (int)(met + 2) % 4), corner(m, met / 4, (int)(met + 1) % 4), u);
        minus(corner(m, met / 4, (int)(met + 3) % 4), corner(m, met / 4, (int)(met + 1) % 4), v);
        memcpy(plane[planes], corner(m, met / 4, (int)(met + 1) % 4), 3 * sizeof(double));
        cross(u, v, plane[planes] + 3);
        minus(o, plane[planes], u);
        if (dot(u, plane[planes] + 3) < 0)
            for (k = 3; k < 6; k++) plane[planes][k] = -plane[planes][k];
        planes++;
    }
    for (e = 0; e < 3; e++) {
        minus(p[(e + 1) % 3], p[e], u);
        size = fmax(size, sqrt(dot(u, u)));
    }
    for (start = 0; start < 2 && best < GOAL; start++) {
        minus(p[1], p[0], u);
        minus(p[2], p[0], v);
        cross(u, v, q);
        minus(corner(m, t, i), p[0], u);
        angle = (dot(q, u) < 0 ? -0.6 : 0.6) * size / fmax(sqrt(dot(q, q)), 1e-300);
        for (k = 0; k < 3; k++)
            here[k] = start ? corner(m, t, i)[k] : (p[0][k] + p[1][k] + p[2][k]) / 3 + angle * q[k];
        best = fmax(best, 0);
        for (step = 0.5 * size, tries = 0; step > 1e-3 * size && tries < 200 && best < GOAL;
             tries++) {
            int moved = 0;
            for (way = tries ? 0 : -1; way < 26; way++) {
                int digits = way < 13 ? way : way + 1, inside = 1; /* 13: stay */
                for (k = 0; k < 3; k++, digits /= 3)
                    q[k] = here[k] + (way < 0 ? 0 : (digits % 3 - 1) * step);
                for (e = 0; e < planes; e++) {
                    minus(q, plane[e], u);
                    inside &= dot(u, plane[e] + 3) >= 0;
                }
                p[3] = q;
                if (!inside || gamma_of(p) <= best) continue;
                best = gamma_of(p);
                memcpy(here, q, sizeof q);
                moved = 1;
            }
            if (!moved) step *= 0.5;
        }
    }
    return best >= GOAL;
}

/* The solid angle at corner i of t up to the surface, or enough. */
static double room_at(const mesh *m, long t, int i, double enough)
{
    long list[2000], v = m->tets[4 * t + i], n = 1, done, j;
    double sum = 0;
    int k, l;
    list[0] = t;
    for (done = 0; done < n && sum < enough; done++) {
        for (l = 0; m->tets[4 * list[done] + l] != v; l++) {}
        sum += solid_angle(corner(m, list[done], l), corner(m, list[done], (l + 1) % 4),
                           corner(m, list[done], (l + 2) % 4), corner(m, list[done], (l + 3) % 4));
        for (k = 0; k < 4; k++) {
            long next = m->behind[4 * list[done] + k];
            if (k == l || next < 0 || n == 2000) continue;
            for (j = 0; j < n && list[j] != next / 4; j++) {}
            if (j == n) list[n++] = next / 4;
        }
    }
    return sum;
}

static int is_free(const mesh *m, long t, const limits *least)
{
    int i, j;
    for (i = 0; i < 4; i++)
        if (m->behind[4 * t + i] < 0 && !facet_allows(m, t, i)) return 0;
    for (i = 0; i < 4; i++)
        for (j = i + 1; j < 4; j++) {
            double one, two, own;
            int a = 0, b;
            while (a == i || a == j) a++;
            b = 6 - i - j - a;
            own = dihedral(corner(m, t, a), corner(m, t, b), corner(m, t, i), corner(m, t, j));
            if (m->behind[turn(m, t, i, j, &one)] < 0 && m->behind[turn(m, t, j, i, &two)] < 0 &&
                one + two - own < least->dihedral)
                return 0;
        }
    for (i = 0; i < 4; i++)
        if (room_at(m, t, i, least->solid) < least->solid) return 0;
    return 1;
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
    long i, below = 0, below30 = 0, num_free = 0;
    limits least;
    if (!f || !read_mesh(f, &m) || m.num_tets == 0) {
        fprintf(stderr, "%s: cannot be read\n", path);
        if (f) fclose(f);
        return 1;
    }
    fclose(f);
    gamma = (double *)malloc((size_t)m.num_tets * sizeof *gamma);
    if (!gamma || !link_tets(&m)) return 1;
    least.dihedral = smallest_angle(0);
    least.solid = smallest_angle(1);
    for (i = 0; i < m.num_tets; i++) sign += measure(&m, m.tets + 4 * i).volume;
    sign = sign < 0 ? -1 : 1;
    for (i = 0; i < m.num_tets; i++) {
        r = measure(&m, m.tets + 4 * i);
        gamma[i] = sign * r.gamma;
        below += gamma[i] < 0.35;
        below30 += gamma[i] < 0.30;
        num_free += gamma[i] < GOAL && is_free(&m, i, &least);
        mean += gamma[i] / (double)m.num_tets;
        sicn = fmin(sicn, sign * r.sicn);
        smallest = fmin(smallest, r.smallest);
        largest = fmax(largest, r.largest);
    }
    qsort(gamma, (size_t)m.num_tets, sizeof *gamma, compare);
    printf("%ld,%.4g,%.4g,%.4g,%.4f,%ld,%ld,%.4g,%.2f,%.2f,%ld\n", m.num_tets, gamma[0],
           gamma[m.num_tets / 1000], gamma[m.num_tets / 100], mean, below, below30, sicn, smallest,
           largest, num_free);
    free(gamma);
    free(m.xyz);
    free(m.tets);
    free(m.ref);
    free(m.behind);
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
                   "dihedral_min,dihedral_max,free35\n");
        header = 0;
        failed |= judge(argv[i]);
    }
    return failed;
}
