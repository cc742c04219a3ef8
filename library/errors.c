// Raises errors and gives notices, as magmotor/mjcf/error_raising.py does it for Python.
#include <stdio.h>
#include <string.h>
#include <strings.h>

#include "library.h"
#include "sentences.h"

// Functions of MuJoCo.
typedef void (*LogHandler)(const void *message);
void mju_error(const char *format, ...) __attribute__((format(printf, 1, 2)));
void mju_warning(const char *format, ...) __attribute__((format(printf, 1, 2)));
LogHandler mju_setLogHandler(LogHandler handler);
LogHandler _mjPRIVATE_getGlobalLogHandler(void);

extern void *magmotor_cell_magmotor_notices_given;

static LogHandler default_handler;  // ends the process at an error, unless mju_user_error is set

void magmotor_note_handler(void) {
  LogHandler before = OF_MUJOCO(mju_setLogHandler)(0);
  default_handler = OF_MUJOCO(mju_setLogHandler)(before);
}

// An error that nobody handles would end the process. It is a warning instead, and the caller makes
// the state NaN, as after a handler that returns.
void magmotor_form_error(int64_t error, int64_t number, const char *name, int64_t other,
                         const char *other_name, const double *details, int64_t handler,
                         int64_t user, const char **text) {
  char sentence[ROOM];
  magmotor_form_sentence(sentence, 1, error, &(Subject){number, name, other, other_name, details});
  (void)text;  // Python's, which it raises after this has returned
  if (handler || user || OF_MUJOCO(_mjPRIVATE_getGlobalLogHandler)() != default_handler)
    OF_MUJOCO(mju_error)("%s", sentence);
  else
    OF_MUJOCO(mju_warning)("%s; the state is set to NaN", sentence);
}

// Python also knows names that merely resemble that of a mark.
static int contains_mark(const char *name) {
  for (; *name; name++)
    if (!strncasecmp(name, MARK_NAME, sizeof MARK_NAME - 1)) return 1;
  return 0;
}

// Whether a sentence has not been given by this process.
static int is_new(const char *sentence) {
  static uint64_t given[256];
  uint64_t hash = 14695981039346656037u;  // FNV-1a
  for (; *sentence; sentence++) hash = (hash ^ (unsigned char)*sentence) * 1099511628211u;
  for (size_t k = 0; k < sizeof given / sizeof *given; k++) {
    uint64_t found = 0;
    if (__atomic_compare_exchange_n(&given[k], &found, hash, 0, __ATOMIC_RELAXED, __ATOMIC_RELAXED))
      return 1;
    if (found == hash) return 0;
  }
  return 1;
}

// A process gives each sentence once, as Python does by default.
void magmotor_form_notice(int64_t which, int64_t number, const char *name, int64_t other,
                          const char *other_name, int64_t unless, int64_t handler, int64_t user,
                          const char **text) {
  (void)handler, (void)user, (void)text;  // warnings are no errors
  if (which == NOT_A_MARK && !contains_mark(name ? name : "")) return;
  int64_t *given = magmotor_cell_magmotor_notices_given, bit = (int64_t)1 << which;
  if (__atomic_fetch_or(given, bit, __ATOMIC_RELAXED) & unless) return;
  char sentence[ROOM];
  magmotor_form_sentence(sentence, 0, which, &(Subject){number, name, other, other_name, 0});
  if (!is_new(sentence)) return;
  if (which == ASSUMED)
    fprintf(stderr, "magmotor: %s\n", sentence);
  else
    OF_MUJOCO(mju_warning)("%s", sentence);
}
