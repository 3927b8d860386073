#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

namespace ist::app {

/// A binary glTF 2.0 scene under construction. Node 0 is its root.
class GlbScene {
 public:
  using Json = nlohmann::ordered_json;

  /// `root`: the contents of node 0.
  explicit GlbScene(Json root) { nodes_.push_back(std::move(root)); }

  /// Adds a mesh with one material: a ball of radius 1, shared by all materials.
  std::size_t add_ball(const std::string& name, const std::array<double, 4>& colour);
  /// Adds a mesh of triangles with flat shading.
  std::size_t add_mesh(const std::string& name, const std::array<double, 4>& colour,
                       std::span<const Eigen::Vector3d> vertices,
                       std::span<const std::array<std::uint32_t, 3>> triangles);

  /// Adds a node below another, or a ball's instance. Nodes are named by their number.
  std::size_t add_node(std::size_t parent, Json node);
  void add_instance(std::size_t parent, std::size_t mesh, const Eigen::Vector3d& at, double scale);

  std::string bytes() const;  ///< of the file

 private:
  std::size_t add_material(const std::string& name, const std::array<double, 4>& colour);
  std::size_t add_view(const void* bytes, std::size_t count, int target);
  /// Adds accessors of the vertices and the triangles, and returns the index of the first.
  template <class Index>
  std::size_t add_triangles(std::span<const Eigen::Vector3d> vertices,
                            std::span<const std::array<Index, 3>> triangles);
  std::size_t add_mesh(const std::string& name, const std::array<double, 4>& colour,
                       const Json& attributes, std::size_t indices);

  Json nodes_ = Json::array(), meshes_ = Json::array(), materials_ = Json::array(),
       accessors_ = Json::array(), views_ = Json::array();
  std::vector<std::vector<std::size_t>> children_ = {{}};
  std::string data_;
  std::size_t ball_ = SIZE_MAX;  ///< accessor of its vertices; that of its triangles follows
};

}  // namespace ist::app
