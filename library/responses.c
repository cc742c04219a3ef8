// Responses of iron, which Python computes and writes to a file: see mjcf/forces/responses.py.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "library.h"

extern void *magmotor_cell_magmotor_responses_address;

enum { KEY = 1, GEOMS };

static int64_t numbers_of(const int64_t *response) {
  return RESPONSE_MATERIAL + RESPONSE_PER_GEOM * response[GEOMS];
}

static int64_t *head_of(const int64_t *response) {
  const int64_t *key = response + response[KEY];
  uint64_t number = 0;
  for (int k = 0; k < numbers_of(response); k++)
    number = (number + (uint64_t)key[k]) * 0x9E3779B97F4A7C15u;
  uint64_t list = number * 0x9E3779B97F4A7C15u >> (64 - RESPONSE_BITS);
  return *(int64_t **)magmotor_cell_magmotor_responses_address + list;
}

// A file has a mark, how many responses there are, and for each its number of words and these.
void magmotor_read_responses(void) {
  const char *path = getenv("MAGMOTOR_RESPONSES");
  if (!path || !*path) return;
  FILE *file = fopen(path, "rb");
  int64_t head[2], words, count = 0;
  int fine = file && fread(head, sizeof head, 1, file) == 1 && !memcmp(head, RESPONSES_MARK, 8);
  for (; fine && count < head[1]; count++) {
    int64_t *response = 0;
    fine = fread(&words, sizeof words, 1, file) == 1 && words > RESPONSE_START && words < 1 << 30 &&
           (response = malloc(8 * (size_t)words)) &&
           fread(response, 8, (size_t)words, file) == (size_t)words && response[GEOMS] > 0 &&
           response[GEOMS] < words && response[KEY] == words - numbers_of(response);
    if (!fine) {
      free(response);
      break;
    }
    int64_t *list = head_of(response);
    response[0] = *list;
    *list = (int64_t)response;
  }
  if (!fine)
    fprintf(stderr, "magmotor: MAGMOTOR_RESPONSES = %s: must be a file by mm.save_responses\n", path);
  if (file) fclose(file);
}

// In C, only what a file has is known.
int64_t magmotor_compute_response(int64_t key, int64_t geoms, int64_t head) {
  (void)key, (void)geoms, (void)head;
  return 0;
}
