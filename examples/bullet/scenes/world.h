#pragma once

#include <btBulletDynamicsCommon.h>

#include <ist/bullet/contacts.h>
#include <Eigen/Geometry>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "part.h"
#include "peer_shapes.h"

/// Who finds the contacts of the parts, and what they do.
enum class Way { solver, wrench, gimpact, hulls, own };
const char* name_of(Way way);

constexpr double kGravity = 9.81;               ///< [m/s²]
constexpr double kGravityOfMillimetres = 9810;  ///< [mm/s²]

constexpr double kWood = 600;      ///< [kg/m³]
constexpr double kFriction = 0.5;  ///< of most bodies

struct WorldSettings {
  Way way = Way::solver;
  double step = 1.0 / 240;  ///< [s]
  Eigen::Vector3d gravity = {0, 0, -kGravity};
  ist::bullet::Settings ist;  ///< `response` follows `way`
  double margin = 0;          ///< [u] of GImpact's triangles and of hulls
  std::size_t hulls = 16;     ///< a part's, at least; 0: one about all of it
  bool by_scene = false;      ///< SceneBroadphase, not Bullet's; parts must be ist's
};

/// A btDiscreteDynamicsWorld whose parts collide in one way, and what can be measured of it.
class SceneWorld {
 public:
  explicit SceneWorld(const WorldSettings& settings);
  ~SceneWorld();

  /// A part with its mesh frame at `at`. Density 0: held still. The part must outlive the world.
  btRigidBody& add(const Part& part, double density, const Eigen::Isometry3d& at, double friction);
  /// A shape of Bullet's that is held still: plane, box, ball or terrain.
  btRigidBody& add_still(std::unique_ptr<btCollisionShape> shape, const Eigen::Isometry3d& at,
                         double friction);

  void step();
  double time() const { return static_cast<double>(steps_) * settings_.step; }  ///< [s]
  double steps_a_second() const { return static_cast<double>(steps_) / seconds_; }

  /// Where a part's mesh frame is.
  Eigen::Isometry3d mesh_frame(const btRigidBody& body) const;
  double kinetic_energy() const;    ///< [mass·u²/s²]
  double potential_energy() const;  ///< [mass·u²/s²] of weight
  double contact_energy() const;    ///< [mass·u²/s²] held by the law's springs; wrench only
  /// [mass·u/s²] of all contacts on a body, friction included, in the last step.
  Eigen::Vector3d contact_force(const btRigidBody& body) const;
  /// [u] of all pairs: the deepest of eight patches, by ist, whoever moved the bodies. Static boxes
  /// and planes count too.
  double deepest_penetration();

  const WorldSettings& settings() const { return settings_; }

  /// What a writer of animations needs of a body.
  struct Body {
    std::unique_ptr<btRigidBody> rigid;
    std::unique_ptr<btCollisionShape> own_shape;
    std::unique_ptr<ist::bullet::Shape> proxy_shape;  ///< null for shapes of Bullet's
    std::unique_ptr<btCollisionObject> proxy;
    const Part* part = nullptr;  ///< null for shapes of Bullet's
  };
  const std::vector<Body>& bodies() const { return bodies_; }

 private:
  btRigidBody& add(Body body, btCollisionShape* shape, double mass, const btTransform& at,
                   double friction);
  btCollisionShape* shape_of(const Part& part);

  WorldSettings settings_;
  ist::bullet::Contacts contacts_;
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  std::unique_ptr<btBroadphaseInterface> broadphase_;
  btSequentialImpulseConstraintSolver solver_;
  mutable btDiscreteDynamicsWorld world_{&dispatcher_, broadphase_.get(), &solver_,
                                         &configuration_};
  std::map<const Part*, std::unique_ptr<ist::bullet::Shape>> ist_shapes_;
  std::map<const Part*, std::unique_ptr<PeerShape>> peer_shapes_;
  std::vector<Body> bodies_;
  long steps_ = 0;
  double seconds_ = 0;
};
