#include <gtest/gtest.h>

#include "haptic_loop/proxy.h"
#include "mesh/samples/samples.h"
#include "support/baked.h"

// A hand that is held to a proxy by a virtual coupling, examples/haptic_loop: over any path it gets
// no more than it put in, unless the coupling is too stiff for the rate.

namespace ist {
namespace {

class HapticPassivity : public ::testing::Test {
 protected:
  /// A capsule pressed onto a cube's face, beside its middle, with a tremor, and taken off again.
  Passivity press(double rate, double coupling_hz, double deepest) {
    Options options;
    options.rate = rate;
    options.seconds = 1;
    options.from[0] = options.to[0] = 0.2;
    options.from[2] = 0.9;
    options.to[2] = deepest;
    options.wiggle = 0.02;
    const Insert hand(options);
    Proxy proxy({capsule_.view(), {}, 0.2}, coupling_hz, options.contact_hz);
    proxy.place(hand.at(0));
    Passivity passivity;
    touched_ = 0;
    for (int i = 0; i < static_cast<int>(rate) && std::isfinite(passivity.deficit); ++i) {
      const Penetration contact = penetration(
          {cube_.view(), {}, 1}, {capsule_.view(), pose_of(proxy.pose()), 0.2}, {}, workspace_);
      touched_ += contact.volume > 0 ? 1 : 0;
      passivity.count(proxy.step(hand.at(i / rate), hand.at((i + 1) / rate), contact, 1 / rate));
    }
    return passivity;
  }

  const Asset cube_ = testing::baked(make_sample("cube"), "cube", 500);
  const Asset capsule_ = testing::baked(make_sample("capsule"), "capsule", 500);
  Workspace workspace_;
  int touched_ = 0;
};

TEST_F(HapticPassivity, ACouplingThatTheRateBearsGivesNoEnergy) {
  for (const double rate : {1000.0, 5000.0})
    for (const double hz : {10.0, 25.0, 50.0})
      for (const double deepest : {0.7, 0.55}) {
        const Passivity passivity = press(rate, hz, deepest);
        EXPECT_GT(touched_, rate / 10) << deepest;
        EXPECT_TRUE(passivity.kept())
            << rate << " " << hz << ": " << passivity.deficit << " of " << passivity.peak;
      }
}

TEST_F(HapticPassivity, ACouplingTooStiffForTheRateIsSeen) {
  EXPECT_FALSE(press(1000, 400, 0.55).kept());
}

}  // namespace
}  // namespace ist
