// Sentences of errors and notices.
#ifndef MAGMOTOR_SENTENCES_H_
#define MAGMOTOR_SENTENCES_H_

#include <stddef.h>
#include <stdint.h>

#include "numbers.h"

// Room for the longest sentence, whose names are short.
enum { ROOM = 4096 };

// What a sentence is about: up to two elements, and numbers.
typedef struct {
  int64_t number;
  const char *name;  // or 0
  int64_t other;
  const char *other_name;
  const double *details;
} Subject;

// Write the sentence of an error or a notice to a text of length `ROOM`.
void magmotor_form_sentence(char *text, int is_error, int64_t which, const Subject *subject);

#endif
