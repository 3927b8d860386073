// Every extreme of tests/support/extremes.h: input, what is promised, what is measured.

#include <cmath>
#include <cstdio>

#include "report.h"
#include "support/extremes.h"

namespace {

std::string figure(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}

}  // namespace

int main(int argc, char** argv) {
  ist::benchmark::Report report("extremes", argc, argv);
  report.page("At the extremes");
  report.remark(
      "Each row is a test too: `property_extremes`. Bakes of 1,000 spheres where no other number "
      "stands.");
  report.remark(
      "Boxes: half-extents (0.5, 0.4, 0.3) and (0.3, 0.5, 0.6) of their size, meshes read from "
      "OBJ; exact volumes by clipping.");
  report.remark(
      "The double sum: the same spheres, every pair of them in double, without tree or unit "
      "frame.");
  report.remark("Where nothing is promised, the figure is a limit to know of.");
  for (const ist::testing::Extreme& extreme : ist::testing::extremes()) {
    const char* input = extreme.input;
    for (const ist::testing::Claim& claim : extreme.claims()) {
      report.row("Promises",
                 {{"input", input},
                  {"measured", claim.what},
                  {"worst", figure(claim.worst)},
                  {"promised at most", std::isinf(claim.limit) ? "nothing" : figure(claim.limit)},
                  {"kept", claim.is_kept()}});
      input = "";
    }
  }
  return report.write();
}
