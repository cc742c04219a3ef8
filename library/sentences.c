#include "library.h"
void magmotor_form_error(int64_t error, int64_t number, const char *name, int64_t other,
                         const char *other_name, const double *details, int64_t handler,
                         int64_t user, const char **text) {
  (void)error,(void)number,(void)name,(void)other,(void)other_name,(void)details,(void)handler,(void)user,(void)text;
}
void magmotor_form_notice(int64_t which, int64_t number, const char *name, int64_t other,
                          const char *other_name, int64_t unless, int64_t handler, int64_t user,
                          const char **text) {
  (void)which,(void)number,(void)name,(void)other,(void)other_name,(void)unless,(void)handler,(void)user,(void)text;
}
