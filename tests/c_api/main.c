#include <stdio.h>

#include "checks.h"

int main(int argc, char** argv) {
  if (argc != 3) return fprintf(stderr, "usage: checks A.ist B.ist\n"), 2;
  return c_api_checks(argv[1], argv[2]);
}
