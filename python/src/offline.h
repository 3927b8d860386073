#pragma once

#include <functional>
#include <memory>
#include <optional>

#include <ist/types.h>

#include "arrays.h"

namespace ist::python {

/// What runs on a thread of its own: it must own all that it uses, Python's objects excepted, of
/// which it may use none.
using OfflineWork = std::function<void(const ProgressCallback&)>;

/// Runs a long stage while the calling thread looks for Ctrl-C and hands on progress.
///
/// `progress` is called on the calling thread with a Progress; False from it cancels as the stage
/// says, what it raises is raised.
/// Its last call, once the work is done, says so. `rounds`: see WholeProgress.
/// Ctrl-C raises KeyboardInterrupt within 0.2 s: the stage is told to end, and where it is in a
/// step that cannot be cut short it ends unseen, after this call has returned.
void run_offline(OfflineWork work, const py::object& progress, bool rounds = false);

/// The same for work that answers.
template <class Work>
auto offline(Work work, const py::object& progress = py::none(), bool rounds = false) {
  using Answer = decltype(work(ProgressCallback()));
  const auto answer = std::make_shared<std::optional<Answer>>();
  run_offline([work = std::move(work), answer](
                  const ProgressCallback& callback) mutable { answer->emplace(work(callback)); },
              progress, rounds);
  return std::move(**answer);
}

/// Of a str or an os.PathLike.
std::string path_of(const py::object& path);

void add_offline(py::module_& module);

}  // namespace ist::python
