// stack BOX.ist [seconds [hz [askew]]]: ten boxes of 0.2 m by the guide's own listing. Exits with 3
// where they do not stand. BOX.ist: a cube.
#include <btBulletDynamicsCommon.h>
#include <ist/bullet/contacts.h>
#include <ist/mass_properties.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <random>
#include <vector>

static ist::AssetView read_asset(const char* path) {
  struct alignas(64) Line {
    char bytes[64];
  };
  static std::vector<Line> memory;
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file) return {};
  const auto size = static_cast<std::size_t>(file.tellg());
  memory.resize(size / sizeof(Line) + 1);
  file.seekg(0).read(memory[0].bytes, static_cast<std::streamsize>(size));
  ist::AssetView tree;
  ist::AssetView::from_bytes({reinterpret_cast<const std::byte*>(memory.data()), size}, tree);
  return tree;
}

int main(int argc, char** argv) {
  const ist::AssetView tree = read_asset(argc > 1 ? argv[1] : "");
  if (tree.empty()) return std::fprintf(stderr, "usage: stack BOX.ist [s [hz [askew]]]\n"), 2;
  const double seconds = argc > 2 ? std::atof(argv[2]) : 8;
  const double hz = argc > 3 ? std::atof(argv[3]) : 240;
  const double off = argc > 4 ? 0.004 : 0, turned = argc > 4 ? 0.06 : 0;  // [m] [rad]
  constexpr double kSide = 0.2;
  constexpr int kBoxes = 10;
  const btScalar mass = 4.8f;

#include "listing.inc"

  world.setGravity({0, 0, btScalar(-9.81)});
  btStaticPlaneShape plane({0, 0, 1}, 0);
  btRigidBody ground(0, nullptr, &plane);
  world.addRigidBody(&ground);
  const double side = std::cbrt(tree.volume());
  const auto scale = static_cast<btScalar>(kSide / side);
  shape.setLocalScaling({scale, scale, scale});
  shape.calculateLocalInertia(mass, inertia);

  std::mt19937 random(7);
  const auto draw = [&] { return static_cast<double>(random()) / 2147483648.0 - 1; };
  std::vector<std::unique_ptr<btRigidBody>> others;
  std::vector<btRigidBody*> boxes = {&body};
  while (boxes.size() < kBoxes) {
    others.push_back(std::make_unique<btRigidBody>(mass, nullptr, &shape, inertia));
    boxes.push_back(others.back().get());
    world.addRigidBody(boxes.back());
  }
  std::vector<btVector3> begin;
  for (int i = 0; i < kBoxes; ++i) {
    const double x = off * draw(), y = off * draw(), angle = turned * draw();
    begin.push_back({btScalar(x), btScalar(y), btScalar(kSide * (i + 0.5))});
    const btTransform at(btQuaternion({0, 0, 1}, btScalar(angle)), begin.back());
    boxes[i]->setWorldTransform(at);
    boxes[i]->setInterpolationWorldTransform(at);
    boxes[i]->setGravity(world.getGravity());
    boxes[i]->setActivationState(DISABLE_DEACTIVATION);
    boxes[i]->setMassProps(mass, inertia);
    boxes[i]->updateInertiaTensor();
  }
  for (int i = 0; i < seconds * hz; ++i) world.stepSimulation(btScalar(1 / hz), 0);

  double tilt = 0, aside = 0, sunk = 0;
  for (int i = 0; i < kBoxes; ++i) {
    const btTransform& at = boxes[i]->getWorldTransform();
    const btVector3 moved = (at.getOrigin() - begin[i]) / btScalar(kSide);
    // A cube's principal axes are any three.
    double up = 0;
    for (int k = 0; k < 3; ++k) up = std::max(up, std::abs(double{at.getBasis()[2][k]}));
    tilt = std::max(tilt, std::acos(std::min(1.0, up)));
    aside = std::max(aside, std::hypot(double{moved.x()}, double{moved.y()}));
    sunk = std::max(sunk, std::abs(double{moved.z()}));
  }
  std::printf("tilt %.2g rad, moved aside by %.2g and in height by %.2g of the side\n", tilt, aside,
              sunk);
  for (btRigidBody* box : boxes) world.removeRigidBody(box);
  world.removeRigidBody(&ground);
  // Each rests a thousandth of its side deep, times the root of the boxes that it carries with
  // itself.
  double depths = 0;
  for (int i = 1; i <= kBoxes; ++i) depths += 0.001 * std::sqrt(i);
  return tilt < 0.02 && aside < (off > 0 ? 0.1 : 0.025) && std::abs(sunk - depths) < 0.002 ? 0 : 3;
}
