#include "c_api/structs.h"
#include "query/base/batch.h"

// Batches: every pair by the function that asks one.

namespace ist::c_api {
namespace {

/// The memory of the workers that answer pairs.
struct Staff {
  ist_workspace_t* workspaces;
  std::size_t workers;
  const ist_parallel_t* parallel;

  ist_status_t check() const noexcept {
    if (workers > 0 && workspaces == nullptr) return IST_NULL_POINTER;
    ist_status_t status = parallel == nullptr ? IST_OK : check_size(parallel);
    for (std::size_t i = 0; i < workers && status == IST_OK; ++i)
      workspace_of(workspaces + i, status);
    return status;
  }
};

/// answers[i] by ask(i, workspace), or `unknown` without workers. `Settings`: of C++, for `given`.
template <class Settings, class Given, class Answer, class Unknown, class Ask>
ist_status_t answer_pairs(std::size_t count, const Given* given, const Staff& staff,
                          Answer* answers, std::size_t answer_size, const Unknown& unknown,
                          const Ask& ask) noexcept {
  if (count > 0 && answers == nullptr) return IST_NULL_POINTER;
  if (answer_size != sizeof(Answer)) return IST_WRONG_SIZE;
  Settings settings;
  ist_status_t status = read(given, settings);
  if (status == IST_OK) status = staff.check();
  if (status != IST_OK) return status;
  if (staff.workers == 0) {
    for (std::size_t i = 0; i < count; ++i) write(unknown, answers[i]);
    return IST_OK;
  }
  const ParallelFor threads = staff.parallel == nullptr
                                  ? ParallelFor{}
                                  : ParallelFor{staff.parallel->run, staff.parallel->pool};
  answer_all(count, staff.workers, threads, [&](std::size_t i, std::size_t worker) {
    answers[i].size = sizeof answers[i];
    // A pool that counts wrongly is told by the answer.
    ask(i, worker < staff.workers ? staff.workspaces + worker : nullptr);
  });
  return IST_OK;
}

}  // namespace
}  // namespace ist::c_api

using namespace ist::c_api;

ist_status_t ist_penetration_batch(const ist_pair_t* pairs, std::size_t count,
                                   const ist_penetration_settings_t* settings,
                                   ist_workspace_t* workspaces, std::size_t workers,
                                   ist_penetration_t* answers, std::size_t answer_size,
                                   const ist_parallel_t* parallel) {
  if (count > 0 && pairs == nullptr) return IST_NULL_POINTER;
  return answer_pairs<ist::PenetrationSettings>(
      count, settings, {workspaces, workers, parallel}, answers, answer_size,
      ist::unknown_penetration(), [&](std::size_t i, ist_workspace_t* scratch) {
        ist_penetration(pairs[i].a, pairs[i].b, settings, scratch, answers + i);
      });
}

ist_status_t ist_separation_batch(const ist_pair_t* pairs, std::size_t count,
                                  const ist_separation_settings_t* settings,
                                  ist_workspace_t* workspaces, std::size_t workers,
                                  ist_separation_t* answers, std::size_t answer_size,
                                  const ist_parallel_t* parallel) {
  if (count > 0 && pairs == nullptr) return IST_NULL_POINTER;
  return answer_pairs<ist::SeparationSettings>(
      count, settings, {workspaces, workers, parallel}, answers, answer_size,
      ist::unknown_separation(), [&](std::size_t i, ist_workspace_t* scratch) {
        ist_separation(pairs[i].a, pairs[i].b, settings, scratch, answers + i);
      });
}

ist_status_t ist_contact_patches_batch(const ist_pair_t* pairs, std::size_t count,
                                       const ist_contact_settings_t* settings,
                                       ist_workspace_t* workspaces, std::size_t workers,
                                       ist_contact_patches_t* patches, ist_penetration_t* wholes,
                                       std::size_t whole_size, const ist_parallel_t* parallel) {
  if (count > 0 && (pairs == nullptr || patches == nullptr)) return IST_NULL_POINTER;
  // All are of one size, or there is no telling where the next one begins.
  for (std::size_t i = 0; i < count; ++i) {
    const ist_status_t status = check_size(patches + i);
    if (status != IST_OK) return status;
    patches[i].count = 0;
  }
  return answer_pairs<ist::ContactSettings>(
      count, settings, {workspaces, workers, parallel}, wholes, whole_size,
      ist::unknown_penetration(), [&](std::size_t i, ist_workspace_t* scratch) {
        ist_contact_patches(pairs[i].a, pairs[i].b, settings, scratch, patches + i, wholes + i);
      });
}
