/* sort_points.c - sorts points along a closed curve, cuts the curve into parts, and prints how
 * compact the parts are.
 *
 *   cc -O3 -fopenmp examples/sort_points.c -o sort_points -lm && ./sort_points [COUNT [PARTS]]
 *
 * Needs hilbert.h only.
 */
#define HILBERT_IMPLEMENTATION
#include "../hilbert.h"
#include <math.h>
#include <stdio.h>

/* Length of the polygonal path through the points in their order. */
static double way(const double (*xyz)[3], size_t count)
{
    double sum = 0;
    for (size_t i = 1; i < count; i++) {
        double d = 0;
        for (int m = 0; m < 3; m++) d += (xyz[i][m] - xyz[i - 1][m]) * (xyz[i][m] - xyz[i - 1][m]);
        sum += sqrt(d);
    }
    return sum;
}

/* The whole number from 1 on that a text stands for, such as 1000 or 1e6; 0 if it is none, or so
 * large that this many points do not fit in memory. */
static size_t number(const char *text)
{
    char *end;
    double value = strtod(text, &end);
    return *text && !*end && value >= 1 && value < (double)(SIZE_MAX / 64) ? (size_t)value : 0;
}

int main(int argc, char **argv)
{
    size_t count = argc > 1 ? number(argv[1]) : 1000000;
    size_t num_parts = argc > 2 ? number(argv[2]) : 8;

    if (count < 1 || num_parts < 1 || num_parts > 1000000) {
        fprintf(stderr, "usage: sort_points [COUNT [PARTS]]\n");
        return 2;
    }
    double(*xyz)[3] = (double(*)[3])malloc(count * sizeof *xyz);
    uint64_t *keys = (uint64_t *)malloc(count * sizeof *keys);
    hilbert_partition *parts = (hilbert_partition *)malloc(num_parts * sizeof *parts);
    if (!xyz || !keys || !parts) {
        fprintf(stderr, "sort_points: out of memory\n");
        return 7;
    }
    uint64_t random = 1;
    for (size_t i = 0; i < 3 * count; i++) {
        random = random * 6364136223846793005u + 1442695040888963407u;
        (&xyz[0][0])[i] = (double)(random >> 11) / 9007199254740992.0;
    }

    double before = way((const double(*)[3])xyz, count);
    hilbert_points points = {xyz, 0, count, 3, HILBERT_DOUBLE};
    hilbert_result result = hilbert_sort_points(xyz, &points, NULL, NULL, NULL);
    if (result == HILBERT_OK) result = hilbert_keys(keys, &points, NULL, NULL, NULL);
    if (result != HILBERT_OK) {
        fprintf(stderr, "sort_points: %s\n", hilbert_result_string(result));
        return 7;
    }
    printf("way through %zu points: %g as they came, %g along the curve\n", count, before,
           way((const double(*)[3])xyz, count));

    hilbert_partition_keys(parts, num_parts, keys, count);
    for (size_t p = 0; p < num_parts && p < 16; p++) {
        double lo[3] = {1, 1, 1}, hi[3] = {0, 0, 0};
        size_t held = 0;
        for (size_t i = 0; i < count; i++) {
            if (!hilbert_partition_has(parts[p], keys[i])) continue;
            held++;
            for (int m = 0; m < 3; m++) {
                lo[m] = fmin(lo[m], xyz[i][m]);
                hi[m] = fmax(hi[m], xyz[i][m]);
            }
        }
        if (held == 0) printf("part %zu: nothing\n", p);
        else printf("part %zu: %zu points in %.2f x %.2f x %.2f\n", p, held, hi[0] - lo[0],
                    hi[1] - lo[1], hi[2] - lo[2]);
    }
    if (num_parts > 16) printf("and %zu parts more\n", num_parts - 16);
    free(xyz);
    free(keys);
    free(parts);
    return 0;
}
