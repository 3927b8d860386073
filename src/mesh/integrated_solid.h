#pragma once

#include <mutex>

#include "mesh/solid_volume.h"

namespace ist {

/// A solid whose volume has no closed form: integrated when it is first asked for.
class IntegratedSolid : public Solid {
 public:
  double volume() const override { return integrated().value; }
  double volume_error() const override { return integrated().error; }

 private:
  const IntegratedVolume& integrated() const {
    std::call_once(once_, [this] { volume_ = integrate_volume(*this); });
    return volume_;
  }

  mutable std::once_flag once_;
  mutable IntegratedVolume volume_;
};

}  // namespace ist
