// The mesh on the card: how long it takes from host triangles to a hierarchy, how many questions a
// second it answers, a warp each, and how long one answer takes. Needs a GPU.

#include <cuda_runtime_api.h>
#include <ist/mesh.h>
#include <ist/solid.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "cuda/packing/mesh/device_mesh.h"
#include "mesh/mesh_solid.h"
#include "report.h"
#include "support/gpu_mesh_queries.h"
#include "support/shared_data.h"
#include "timing.h"

namespace {

using ist::benchmark::quantile;
using ist::benchmark::Report;
using ist::benchmark::wall_seconds;
using ist::gpu::check;
using ist::gpu::DeviceArray;
using ist::gpu::DeviceMesh;
using ist::gpu::ExactQuestion;
using ist::gpu::LineQuestion;
using ist::gpu::NearestQuestion;
using ist::gpu::Queue;

/// Wall seconds of `work`, which ends with a wait: median, least and most of `rounds`.
struct Times {
  double median, least, most;
};

Times time(int rounds, const std::function<void()>& work) {
  for (int i = 0; i < 3; ++i) work();  // warm-up: the memory pool grows
  std::vector<double> seconds;
  for (int i = 0; i < rounds; ++i) {
    const double start = wall_seconds();
    work();
    seconds.push_back(wall_seconds() - start);
  }
  return {quantile(seconds, 0.5), quantile(seconds, 0), quantile(seconds, 1)};
}

class MeshOnCard {
 public:
  MeshOnCard(Report& report, const std::string& name, const std::string& path)
      : report_(report),
        name_(name),
        solid_(ist::close_mesh(ist::load_mesh(path), name)),
        host_(solid_.arrays()),
        queue_(ist::GpuSettings{}) {}

  void build() {
    const int rounds = report_.quick() ? 10 : 50;
    const std::size_t vertex_bytes = 24 * std::size_t{host_.vertex_count};
    const std::size_t bytes = vertex_bytes + 12 * std::size_t{host_.triangle_count};
    {
      DeviceArray<double> vertices(queue_, vertex_bytes / 8);
      DeviceArray<std::uint32_t> triangles(queue_, (bytes - vertex_bytes) / 4);
      const Times t = time(rounds, [&] {
        vertices.upload({host_.vertices, vertices.size()});
        triangles.upload({host_.triangles, triangles.size()});
        queue_.wait();
      });
      row("copying to the card alone", t, bytes);
    }
    queue_.reset_peak();
    std::size_t kept = 0;
    const Times t = time(rounds, [&] {
      const DeviceMesh mesh(queue_, host_);
      kept = mesh.bytes();
      queue_.wait();
    });
    row("host triangles to hierarchy", t, bytes);
    ist::MeshView pinned = host_;
    void* memory = nullptr;
    check(cudaMallocHost(&memory, bytes), "allocating pinned memory");
    std::memcpy(memory, host_.vertices, vertex_bytes);
    pinned.vertices = static_cast<const double*>(memory);
    char* const triangles = static_cast<char*>(memory) + vertex_bytes;
    pinned.triangles = reinterpret_cast<std::uint32_t*>(triangles);
    std::memcpy(triangles, host_.triangles, bytes - vertex_bytes);
    row("the same from pinned memory",
        time(rounds,
             [&] {
               const DeviceMesh mesh(queue_, pinned);
               queue_.wait();
             }),
        bytes);
    cudaFreeHost(memory);
    report_.row("Memory", {{"mesh", name_},
                           {"triangles", host_.triangle_count},
                           {"kept, MB", double(kept) * 1e-6},
                           {"peak of the build, MB", double(queue_.peak_bytes()) * 1e-6}});
  }

  void questions() {
    const DeviceMesh mesh(queue_, host_);
    const std::size_t count = report_.quick() ? 100'000 : 1'000'000;
    std::mt19937_64 random(1);
    std::uniform_real_distribution<double> coordinate(-1, 1);
    std::vector<ExactQuestion> inside, close;
    while (inside.size() < count) {
      std::vector<ExactQuestion> drawn(count);
      for (auto& q : drawn)
        q = {{coordinate(random), coordinate(random), coordinate(random)}, HUGE_VAL};
      const std::vector<int> winding = answers<int>(mesh, drawn);
      for (std::size_t i = 0; i < count && inside.size() < count; ++i)
        if (winding[i] >= 1) inside.push_back(drawn[i]);
    }
    while (close.size() < count) {
      const auto index = static_cast<std::uint32_t>(random() % host_.triangle_count);
      const auto t = ist::triangle_corners(host_, index);
      ExactQuestion q = {{}, HUGE_VAL};
      for (int k = 0; k < 3; ++k)
        q.p[k] = (t[0][k] + t[1][k] + t[2][k]) / 3 + 1e-3 * coordinate(random);
      close.push_back(q);
    }
    for (const auto& [where, points] : {std::pair{"inside", inside}, {"near the surface", close}}) {
      std::vector<NearestQuestion> nearest;
      for (const auto& q : points)
        nearest.push_back({{float(q.p[0]), float(q.p[1]), float(q.p[2])}, 1e30f});
      rate<ist::WideNearest>(mesh, where, "nearest, no limit", nearest);
      const auto found = answers<ist::WideNearest>(mesh, nearest);
      for (std::size_t i = 0; i < count; ++i) nearest[i].limit2 = 2.25f * found[i].distance2;
      rate<ist::WideNearest>(mesh, where, "nearest, limit 1.5 × distance", nearest);
      std::vector<ExactQuestion> exact = points;
      for (std::size_t i = 0; i < count; ++i)
        exact[i].limit = 1.0001 * std::sqrt(double(found[i].distance2)) + 1e-6;
      rate<ist::WideExact>(mesh, where, "exact, limit 1.0001 × distance", exact);
      rate<int>(mesh, where, "winding number", points);
      std::vector<LineQuestion> lines;
      for (const auto& q : points) lines.push_back({q.p[1], q.p[2]});
      rate<ist::gpu::LineCrossings>(mesh, where, "line crossings", lines);
    }
  }

 private:
  void row(const std::string& what, const Times& t, std::size_t bytes) {
    report_.row("Build", {{"mesh", name_},
                          {"what", what},
                          {"ms, median", 1e3 * t.median},
                          {"least", 1e3 * t.least},
                          {"most", 1e3 * t.most},
                          {"GB/s of triangles", double(bytes) / t.median * 1e-9}});
  }

  template <class Answer, class Question>
  std::vector<Answer> answers(const DeviceMesh& mesh, const std::vector<Question>& questions) {
    DeviceArray<Question> asked(queue_, questions.size());
    DeviceArray<Answer> found(queue_, questions.size());
    asked.upload(questions);
    ask(queue_, mesh.tree(), asked, found);
    return found.to_host(questions.size());
  }

  template <class Answer, class Question>
  void rate(const DeviceMesh& mesh, const std::string& where, const std::string& what,
            const std::vector<Question>& questions) {
    DeviceArray<Question> asked(queue_, questions.size());
    DeviceArray<Answer> found(queue_, questions.size());
    asked.upload(questions);
    const Times all = time(5, [&] {
      ask(queue_, mesh.tree(), asked, found);
      queue_.wait();
    });
    constexpr std::size_t kOneByOne = 4000;
    DeviceArray<Question> few(queue_, kOneByOne);
    few.upload({questions.data(), kOneByOne});
    const Times one = time(3, [&] {
      ask(queue_, mesh.tree(), few, found, 1);
      queue_.wait();
    });
    report_.row("Questions", {{"mesh", name_},
                              {"points", where},
                              {"what", what},
                              {"million a second", double(questions.size()) / all.median * 1e-6},
                              {"µs one by one", 1e6 * one.median / kOneByOne}});
  }

  Report& report_;
  std::string name_;
  ist::MeshSolid solid_;
  const ist::MeshView& host_;
  Queue queue_;
};

}  // namespace

int main(int argc, char** argv) {
  Report report("gpu_mesh", argc, argv);
  for (const auto& [name, path] : {std::pair{"dino", "oracle/meshes/dino.off"},
                                   {"dragon_871k", "meshes/dev/dragon_871k.ply"}}) {
    MeshOnCard mesh(report, name, ist::testing::shared_path(path).string());
    mesh.build();
    mesh.questions();
  }
  return report.write();
}
