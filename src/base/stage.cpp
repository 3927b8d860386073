#include "base/stage.h"

#include <ist/types.h>
#include <string>

namespace ist {

double Stage::elapsed() const {
  return std::chrono::duration<double>(Clock::now() - start_).count();
}

void Stage::step(std::size_t spheres, double fraction) {
  if (!progress_) return;
  Progress now;
  now.spheres = spheres;
  now.fraction = fraction;
  if (!report(now)) throw Error(std::string(name_) + ": cancelled");
}

bool Stage::due() {
  if (!progress_) return false;
  const auto now = Clock::now();
  if (last_report_ && now - *last_report_ < std::chrono::milliseconds(100)) return false;
  last_report_ = now;
  return true;
}

bool Stage::report(Progress now) {
  now.stage = name_;
  now.elapsed = elapsed();
  return progress_(now);
}

}  // namespace ist
