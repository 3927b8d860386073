#include "support/gpu_mesh_queries.h"

#include <algorithm>

#include "cuda/base/warp_team.h"
#include "mesh/hierarchy/wide_searches.h"

namespace ist::gpu {
namespace {

constexpr unsigned kThreads = 128;
constexpr unsigned kWarps = kThreads / 32;

__device__ void answer(const WarpTeam& team, const WideTree& tree, const NearestQuestion& question,
                       WideNearest& out) {
  const WideNearest found = nearest(team, tree, question.p, question.limit2);
  if (team.lane() == 0) out = found;
}

__device__ void answer(const WarpTeam& team, const WideTree& tree, const NearestQuestion& question,
                       TrianglesWithin& out) {
  const int count = triangles_within(team, tree, question.p, question.limit2, out.slot,
                                     TrianglesWithin::kCapacity);
  if (team.lane() == 0) out.count = count;
}

__device__ void answer(const WarpTeam& team, const WideTree& tree, const ExactQuestion& question,
                       WideExact& out) {
  const WideExact found = exact_nearest(team, tree, question.p, question.limit);
  if (team.lane() == 0) out = found;
}

__device__ void answer(const WarpTeam& team, const WideTree& tree, const ExactQuestion& question,
                       int& out) {
  const int winding = winding_number(team, tree, question.p);
  if (team.lane() == 0) out = winding;
}

__device__ void answer(const WarpTeam& team, const WideTree& tree, const LineQuestion& question,
                       LineCrossings& out) {
  const int count =
      line_crossings(team, tree, question.y, question.z, out.x, out.sign, LineCrossings::kCapacity);
  if (team.lane() == 0) out.count = count;
}

template <class Question, class Answer>
__global__ void answer_all(const __grid_constant__ WideTree tree, const Question* questions,
                           std::size_t count, Answer* answers, unsigned warps) {
  const unsigned warp = blockIdx.x * kWarps + threadIdx.x / 32;
  if (warp >= warps) return;
  for (std::size_t i = warp; i < count; i += warps)
    answer(WarpTeam(), tree, questions[i], answers[i]);
}

template <class Question, class Answer>
void ask_all(Queue& queue, const WideTree& tree, const DeviceArray<Question>& questions,
             DeviceArray<Answer>& answers, unsigned warps) {
  if (questions.size() == 0) return;
  constexpr std::size_t kMost = 1u << 24;
  if (warps == 0) warps = static_cast<unsigned>(std::min(questions.size(), kMost));
  answer_all<<<(warps + kWarps - 1) / kWarps, kThreads, 0, queue.stream()>>>(
      tree, questions.data(), questions.size(), answers.data(), warps);
  check_launch("querying the mesh");
}

}  // namespace

void ask(Queue& queue, const WideTree& tree, const DeviceArray<NearestQuestion>& questions,
         DeviceArray<WideNearest>& answers, unsigned warps) {
  ask_all(queue, tree, questions, answers, warps);
}

void ask(Queue& queue, const WideTree& tree, const DeviceArray<NearestQuestion>& questions,
         DeviceArray<TrianglesWithin>& answers, unsigned warps) {
  ask_all(queue, tree, questions, answers, warps);
}

void ask(Queue& queue, const WideTree& tree, const DeviceArray<ExactQuestion>& questions,
         DeviceArray<WideExact>& answers, unsigned warps) {
  ask_all(queue, tree, questions, answers, warps);
}

void ask(Queue& queue, const WideTree& tree, const DeviceArray<ExactQuestion>& questions,
         DeviceArray<int>& answers, unsigned warps) {
  ask_all(queue, tree, questions, answers, warps);
}

void ask(Queue& queue, const WideTree& tree, const DeviceArray<LineQuestion>& questions,
         DeviceArray<LineCrossings>& answers, unsigned warps) {
  ask_all(queue, tree, questions, answers, warps);
}

}  // namespace ist::gpu
