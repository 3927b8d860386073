#include "library/whole_progress.h"

#include <algorithm>
#include <array>
#include <string_view>

namespace ist {
namespace {

struct StageShare {
  std::string_view name;
  double begin;  ///< as a share of a round's time
};
/// Shares of the time of bakes of 1,000 to 10,000 spheres. Stages that are not needed are skipped.
constexpr std::array<StageShare, 7> kStages = {{{"polygonise", 0},
                                                {"resolve", 0.05},
                                                {"pack", 0.1},
                                                {"calibrate", 0.45},
                                                {"cover", 0.8},
                                                {"tree", 0.93},
                                                {"predict", 0.97}}};

}  // namespace

double WholeProgress::share(const Progress& progress) {
  const auto* const found =
      std::find_if(kStages.begin(), kStages.end(),
                   [&](const StageShare& one) { return one.name == progress.stage; });
  if (found == kStages.end()) return share_ = std::max(share_, progress.fraction);
  const auto stage = static_cast<int>(found - kStages.begin());
  if (stage < stage_) {  // the next round
    begin_ = share_;
    rest_ = 1 - share_;
  }
  stage_ = stage;
  const double end = found + 1 == kStages.end() ? 1 : found[1].begin;
  const double of_round = found->begin + (end - found->begin) * progress.fraction;
  // A round takes half of the remaining share, as if another followed.
  return share_ = std::max(share_, begin_ + rest_ * of_round * (rounds_ ? 0.5 : 1));
}

}  // namespace ist
