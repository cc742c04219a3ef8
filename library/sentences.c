// Forms the sentences that magmotor/mjcf/{error,notice}_sentences.py have, as Python does it.
#include "sentences.h"

#include "library.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const char *mju_type2Str(int type);  // of MuJoCo

static const struct {
  int is_error;
  int64_t which, form;
  const char *sentence;
} rows[] = {
#define ERROR(which, form, sentence) {1, which, form, sentence},
#define NOTICE(which, form, sentence) {0, which, form, sentence},
#include "sentences.inc"
};

typedef struct {
  char *at, *end;
} Text;

static void put(Text *text, const char *format, ...) {
  va_list arguments;
  va_start(arguments, format);
  int length = vsnprintf(text->at, (size_t)(text->end - text->at), format, arguments);
  text->at += length < text->end - text->at ? length : text->end - text->at - 1;
  va_end(arguments);
}

// ---- Names, which are UTF-8 or else Latin-1
// Return the number of bytes of a character in UTF-8, or 0 if it is none.
static int bytes_of(const unsigned char *at) {
  int count = 1 + (*at >= 0xc2) + (*at >= 0xe0) + (*at >= 0xf0);
  if ((*at >= 0x80 && *at < 0xc2) || *at > 0xf4) return 0;
  for (int k = 1; k < count; k++)
    if ((at[k] & 0xc0) != 0x80) return 0;
  if ((*at == 0xe0 && at[1] < 0xa0) || (*at == 0xed && at[1] > 0x9f)) return 0;
  if ((*at == 0xf0 && at[1] < 0x90) || (*at == 0xf4 && at[1] > 0x8f)) return 0;
  return count;
}

static int is_utf8(const unsigned char *at) {
  for (int count; *at; at += count)
    if (!(count = bytes_of(at))) return 0;
  return 1;
}

// Write a character as in a literal of Python; all above Latin-1 are taken for printable.
static void put_character(Text *text, const unsigned char *at, int count, char quote) {
  unsigned code = count == 2 && *at < 0xc4 ? (*at & 3u) << 6 | (at[1] & 0x3fu) : *at;
  if (count > 2 || (count == 2 && *at >= 0xc4))
    put(text, "%.*s", count, (const char *)at);
  else if (code == '\n' || code == '\r' || code == '\t')
    put(text, "\\%c", code == '\n' ? 'n' : code == '\r' ? 'r' : 't');
  else if (code == '\\' || code == (unsigned char)quote)
    put(text, "\\%c", (char)code);
  else if (code < ' ' || (code >= 0x7f && code <= 0xa0) || code == 0xad)
    put(text, "\\x%02x", code);
  else if (code < 0x80)
    put(text, "%c", (char)code);
  else
    put(text, "%c%c", (char)(0xc0 | code >> 6), (char)(0x80 | (code & 0x3f)));
}

static void put_name(Text *text, const char *name) {
  const unsigned char *start = (const unsigned char *)(name ? name : ""), *end = start;
  int utf8 = is_utf8(start), length = 0;
  for (; *end && length < LONGEST; length++) end += utf8 ? bytes_of(end) : 1;
  size_t size = (size_t)(end - start);
  char quote = memchr(start, '\'', size) && !memchr(start, '"', size) ? '"' : '\'';
  put(text, "%c", quote);
  for (const unsigned char *at = start; at < end; at += utf8 ? bytes_of(at) : 1)
    put_character(text, at, utf8 ? bytes_of(at) : 1, quote);
  put(text, "%s%c", *end ? "..." : "", quote);
}

// ---- Fields
static void put_number(Text *text, double number, const char *format, int length) {
  char printf_format[16], *start = text->at;
  snprintf(printf_format, sizeof printf_format, "%%%.*s", length, format);
  if (isnan(number))
    put(text, "nan");
  else
    put(text, printf_format, number);
  if ((start = strchr(start, ','))) *start = '.';  // in some languages
}

static void put_field(Text *text, const char *field, const Subject *of) {
  int length = (int)strcspn(field, "}"), place = (int)strcspn(field, ":");
#define IS(name) (length == sizeof name - 1 && !strncmp(field, name, sizeof name - 1))
  if (IS("name") || (IS("one") && of->name && *of->name))
    put_name(text, of->name);
  else if (IS("other_name") || (IS("another") && of->other_name && *of->other_name))
    put_name(text, of->other_name);
  else if (IS("number") || IS("one"))
    put(text, "%lld", (long long)of->number);
  else if (IS("other") || IS("another"))
    put(text, "%lld", (long long)of->other);
  else if (IS("kind"))
    put(text, "%s", OF_MUJOCO(mju_type2Str)((int)of->details[KIND]));
  else
    put_number(text, of->details[atoi(field)], field + place + 1, length - place - 1);
#undef IS
}

void magmotor_form_sentence(char *text, int is_error, int64_t which, const Subject *of) {
  const char *at = "magmotor has no words for this";
  int64_t form = is_error ? (int64_t)of->details[FORM] : of->number;
  for (size_t k = 0, found = 0; k < sizeof rows / sizeof *rows && !found; k++)
    if (rows[k].is_error == is_error && rows[k].which == which) {
      found = rows[k].form == form;
      if (found || rows[k].form == ELSE) at = rows[k].sentence;
    }
  Text to = {text, text + ROOM};
  for (; *at; at++) {
    if (*at != '{') {
      put(&to, "%c", *at);
      continue;
    }
    put_field(&to, at + 1, of);
    at += strcspn(at, "}");
  }
}
