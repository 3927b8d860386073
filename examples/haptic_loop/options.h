#pragma once

#include <cstdlib>
#include <cstring>

#include <cstdio>

inline constexpr const char* kUsage =
    "usage: haptic_loop OBJECT.ist PROBE.ist [--scale S]   of the probe (1)\n"
    "                   [--seconds T] [--rate HZ]          how long (60), how often (1000)\n"
    "                   [--deadline-us D]                  time of a query (0: no limit)\n"
    "                   [--exact]                          the meshes' own volume; not with a "
    "deadline\n"
    "                   [--load N]                         threads that burden the machine (0)\n"
    "                   [--fifo]                           real-time priority, if permitted\n"
    "                   [--motion stroke|insert|FILE.csv]  the hand's (stroke)\n"
    "                   [--from X,Y,Z] [--to X,Y,Z]        insert: there and back\n"
    "                   [--turns N] [--wiggle W]           insert: about z on the way; [u]\n"
    "                   [--cycles N]                       insert: so often in all (1)\n"
    "                   [--coupling-hz F]                  spring between hand and proxy (25)\n"
    "                   [--contact-hz F]                   spring of the contact (40)\n"
    "                   [--offline]                        as fast as it goes\n"
    "                   [--search]                         stiffest coupling that is passive\n"
    "                   [--trace FILE.csv] [--json FILE]\n";

struct Options {
  const char* object = nullptr;
  const char* probe = nullptr;
  const char* json = nullptr;
  const char* trace = nullptr;
  const char* motion = "stroke";
  double scale = 1, seconds = 60, rate = 1000, deadline_us = 0;
  double from[3] = {0, 0, 0}, to[3] = {0, 0, 0};  ///< [u]
  double turns = 0, wiggle = 0, cycles = 1;
  double coupling_hz = 25, contact_hz = 40;
  int load = 0;
  bool exact = false, fifo = false, offline = false, search = false;
};

/// Ends the program with code 2 on a wrong usage.
inline Options parse(int argc, char** argv) {
  Options options;
  const struct {
    const char* name;
    double* value;
  } numbers[] = {
      {"--scale", &options.scale},
      {"--seconds", &options.seconds},
      {"--rate", &options.rate},
      {"--deadline-us", &options.deadline_us},
      {"--turns", &options.turns},
      {"--wiggle", &options.wiggle},
      {"--cycles", &options.cycles},
      {"--coupling-hz", &options.coupling_hz},
      {"--contact-hz", &options.contact_hz},
  };
  const struct {
    const char* name;
    const char** value;
  } names[] = {
      {"--json", &options.json}, {"--trace", &options.trace}, {"--motion", &options.motion}};
  const struct {
    const char* name;
    bool* value;
  } flags[] = {{"--exact", &options.exact},
               {"--fifo", &options.fifo},
               {"--offline", &options.offline},
               {"--search", &options.search}};
  const char** files[] = {&options.object, &options.probe};
  int file = 0;
  bool wrong = false;
  for (int i = 1; i < argc; ++i) {
    const auto is = [&](const char* name) { return std::strcmp(argv[i], name) == 0; };
    bool known = false;
    for (const auto& flag : flags)
      if (is(flag.name)) known = *flag.value = true;
    if (known) continue;
    if (argv[i][0] != '-') {
      wrong = wrong || file == 2;
      if (file < 2) *files[file++] = argv[i];
      continue;
    }
    if (i + 1 == argc) {
      wrong = true;
      break;
    }
    const char* const value = argv[i + 1];
    for (const auto& number : numbers)
      if (is(number.name)) known = true, *number.value = std::atof(value);
    for (const auto& name : names)
      if (is(name.name)) known = true, *name.value = value;
    if (is("--load")) known = true, options.load = std::atoi(value);
    for (double* const place :
         {is("--from") ? options.from : nullptr, is("--to") ? options.to : nullptr})
      if (place != nullptr)
        known = std::sscanf(value, "%lf,%lf,%lf", place, place + 1, place + 2) == 3;
    wrong = wrong || !known;
    ++i;
  }
  if (wrong || file != 2 || !(options.scale > 0) || !(options.seconds > 0) || !(options.rate > 0) ||
      !(options.cycles > 0) || !(options.coupling_hz > 0) || !(options.contact_hz > 0) ||
      (options.exact && options.deadline_us > 0)) {
    std::fputs(kUsage, stderr);
    std::exit(2);
  }
  return options;
}
