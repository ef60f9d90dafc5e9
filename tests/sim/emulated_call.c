/* Lets another process call a kernel's functions: appended to the kernel's source, with FUNCTIONS
   and a main that is run under an emulator.

   Standard input holds 64-bit integers: number of the function, how many pointers there are to set
   right, size of the memory, ARGUMENTS arguments; then the pointers' places in the memory, then the
   memory itself. A pointer is given as the place it points to; so are arguments from the first one
   on, of which the bit is set in the last number of the head. Standard output is the result, then
   the memory as the function leaves it. */
#include <stdio.h>
#include <stdlib.h>

enum { ARGUMENTS = 8 };

typedef int64_t (*Function)(int64_t, int64_t, int64_t, int64_t, int64_t, int64_t, int64_t, int64_t);

static void take(void *to, size_t size)
{
  if (fread(to, 1, size, stdin) != size) exit(2);
}

int main(void)
{
  static const Function functions[] = {FUNCTIONS};
  int64_t head[3 + ARGUMENTS + 1];
  take(head, sizeof head);
  const size_t n_pointers = (size_t)head[1], size = (size_t)head[2];
  int64_t *places = malloc((n_pointers + 1) * sizeof *places);
  char *memory = aligned_alloc(64, (size / 64 + 1) * 64);
  take(places, n_pointers * sizeof *places);
  take(memory, size);
  for (size_t k = 0; k < n_pointers; k++) {
    int64_t at;
    memcpy(&at, memory + places[k], sizeof at);
    at += (int64_t)memory;
    memcpy(memory + places[k], &at, sizeof at);
  }
  int64_t *a = head + 3;
  for (int k = 0; k < ARGUMENTS; k++)
    if (a[ARGUMENTS] >> k & 1) a[k] += (int64_t)memory;
  const int64_t result = functions[head[0]](a[0], a[1], a[2], a[3], a[4], a[5], a[6], a[7]);
  fwrite(&result, sizeof result, 1, stdout);
  fwrite(memory, 1, size, stdout);
  return 0;
}
