#include <gtest/gtest.h>
#include <ist/bake.h>
#include <ist/query.h>
#include <ist/time_of_impact.h>

#include <algorithm>
#include <cstring>
#include <new>
#include <random>
#include <vector>

#include "mesh/samples/samples.h"
#include "support/answer_bits.h"
#include "support/random_assets.h"

namespace ist {
namespace {

/// The content of a workspace's memory before its first use.
enum class Held { zeros, ones, numbers, noise };

void fill(Held held, std::byte* memory, std::size_t bytes) {
  if (held == Held::zeros) std::memset(memory, 0, bytes);
  if (held == Held::ones) std::memset(memory, 0xff, bytes);  // NaN, and counts out of any range
  std::mt19937_64 random(bytes);
  std::uniform_real_distribution<double> number(-1, 1);
  for (std::size_t i = 0; held >= Held::numbers && i + 8 <= bytes; i += 8) {
    const double x = number(random);
    const std::uint64_t bits = random();
    if (held == Held::numbers)
      std::memcpy(memory + i, &x, 8);
    else
      std::memcpy(memory + i, &bits, 8);
  }
}

Workspace workspace_holding(Held& held) {
  return Workspace(1 << 16,
                   {[](void* context, std::size_t bytes, std::size_t alignment) {
                      void* const memory = ::operator new(bytes, std::align_val_t(alignment));
                      fill(*static_cast<Held*>(context), static_cast<std::byte*>(memory), bytes);
                      return memory;
                    },
                    [](void*, void* memory, std::size_t bytes, std::size_t alignment) {
                      ::operator delete(memory, bytes, std::align_val_t(alignment));
                    },
                    &held});
}

/// Bits of every kind of answer, pose by pose.
std::vector<std::uint64_t> answers(const Asset& x, const Asset& y, Held held) {
  Workspace workspace = workspace_holding(held);
  std::mt19937_64 random(7);
  std::vector<std::uint64_t> all;
  ContactPatch patches[16];
  std::vector<OutlineSegment> segments(4000);
  for (int i = 0; i < 60; ++i) {
    const PlacedAsset a{x.view(), {}, 1}, b{y.view(), testing::random_pose(random, 0.1 * i), 1};
    testing::AnswerBits bits;
    for (const Measure measure : {Measure::matched, Measure::inner, Measure::exact}) {
      PenetrationSettings settings;
      settings.measure = measure;
      bits.add(penetration(a, b, settings, workspace));
      ContactSettings contacts;
      contacts.measure = measure;
      const ContactPatches contact = contact_patches(a, b, contacts, workspace, patches);
      bits.add(contact.penetration);
      for (std::size_t p = 0; p < contact.count; ++p) bits.add(patches[p]);
    }
    const OverlapOutline outline = overlap_outline(a, b, {}, workspace, patches, segments);
    for (std::size_t s = 0; s < std::min(outline.segments, segments.size()); ++s) {
      bits.add(segments[s].from);
      bits.add(segments[s].to);
      bits.add(std::uint64_t{segments[s].patch});
    }
    bits.add(separation(a, b, {}, workspace));
    SeparationSettings spheres;
    spheres.inner_spheres = true;
    bits.add(separation(a, b, spheres, workspace));
    all.push_back(bits.value());
  }
  return all;
}

TEST(WorkspaceMemory, WhatItHeldChangesNoBit) {
  const auto baked = [](const char* name) {
    return bake(close_mesh(make_sample(name), name), {.max_spheres = 400});
  };
  const Asset knot = baked("torus_knot"), nut = baked("nut");
  const std::vector<std::uint64_t> expected = answers(knot, nut, Held::zeros);
  for (const Held held : {Held::ones, Held::numbers, Held::noise})
    EXPECT_EQ(answers(knot, nut, held), expected) << static_cast<int>(held);
}

/// Counts writes beyond what a workspace took.
struct Guard {
  static constexpr std::size_t kBytes = 4096;
  int written_beyond = 0;
};

TEST(WorkspaceMemory, NoQueryWritesBeyondIt) {
  const Asset knot = bake(close_mesh(make_sample("torus_knot"), "knot"), {.max_spheres = 400});
  // Copies in one place: every triangle meets its neighbours, and no sign is clear.
  for (const std::size_t capacity : {64, 3000, 50'000, 1 << 17}) {
    Guard guard;
    {
      Workspace workspace(
          capacity, {[](void*, std::size_t bytes, std::size_t alignment) {
                       void* const memory =
                           ::operator new(bytes + Guard::kBytes, std::align_val_t(alignment));
                       std::memset(static_cast<std::byte*>(memory) + bytes, 0x5a, Guard::kBytes);
                       return memory;
                     },
                     [](void* context, void* memory, std::size_t bytes, std::size_t alignment) {
                       const auto* const end = static_cast<const unsigned char*>(memory) + bytes;
                       static_cast<Guard*>(context)->written_beyond += std::any_of(
                           end, end + Guard::kBytes, [](unsigned char c) { return c != 0x5a; });
                       ::operator delete(memory, std::align_val_t(alignment));
                     },
                     &guard});
      PenetrationSettings settings;
      settings.measure = Measure::exact;
      const PlacedAsset placed{knot.view(), {}, 1};
      const Penetration answer = penetration(placed, placed, settings, workspace);
      EXPECT_LE(answer.volume_min, knot.view().volume());
      EXPECT_GE(answer.volume_max, knot.view().volume());
      separation(placed, placed, {}, workspace);
    }
    EXPECT_EQ(guard.written_beyond, 0) << capacity;
  }
}

}  // namespace
}  // namespace ist
