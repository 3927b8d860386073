#include "offline.h"

#include <atomic>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>

#include "library/whole_progress.h"

namespace ist::python {
namespace {

using namespace std::chrono_literals;

constexpr auto kLook = 50ms;       // between checks for signals
constexpr auto kPatience = 100ms;  // for a stage that was told to stop

struct CallProgress : Progress {
  double total = 0;
};

/// Data shared by both threads.
struct Job {
  std::mutex mutex;
  std::condition_variable changed;
  bool done = false;             // guarded, as are the next two
  std::optional<Progress> news;  // not yet reported
  std::exception_ptr error;
  std::atomic<bool> cancelled = false;
};

/// The number of running stages, including those that nobody waits for: the interpreter must not
/// end before them.
std::atomic<int>& running() {
  static auto* const count = new std::atomic<int>(0);  // outlives every thread
  return *count;
}

void end_running() {
  --running();
  running().notify_all();
}

void work_apart(OfflineWork work, const std::shared_ptr<Job>& job) {
  std::exception_ptr error;
  try {
    work([&](const Progress& progress) {
      const std::lock_guard lock(job->mutex);
      job->news = progress;
      job->changed.notify_all();
      return !job->cancelled.load();
    });
  } catch (...) {
    error = std::current_exception();
  }
  work = nullptr;  // its resources are released before its end is signalled
  {
    const std::lock_guard lock(job->mutex);
    job->done = true;
    job->error = std::move(error);
    job->changed.notify_all();
  }
}

/// Tells the stage to stop, and waits briefly.
void give_up(Job& job) {
  job.cancelled = true;
  const py::gil_scoped_release released;
  std::unique_lock lock(job.mutex);
  job.changed.wait_for(lock, kPatience, [&] { return job.done; });
}

}  // namespace

void run_offline(OfflineWork work, const py::object& progress, bool rounds) {
  const auto job = std::make_shared<Job>();
  ++running();
  try {
    std::thread([work = std::move(work), job]() mutable {
      work_apart(std::move(work), job);
      end_running();
    }).detach();
  } catch (...) {
    end_running();
    throw;
  }
  WholeProgress whole(rounds);
  CallProgress last;
  for (bool done = false; !done;) {
    std::optional<Progress> news;
    {
      const py::gil_scoped_release released;
      std::unique_lock lock(job->mutex);
      job->changed.wait_for(lock, kLook, [&] { return job->done || job->news.has_value(); });
      news = std::exchange(job->news, std::nullopt);
      done = job->done;
    }
    try {
      if (PyErr_CheckSignals() != 0) throw py::python_error();
      if (news && !progress.is_none()) {
        last = {*news, whole.share(*news)};
        if (progress(last).ptr() == Py_False) job->cancelled = true;
      }
    } catch (...) {
      give_up(*job);
      throw;
    }
  }
  if (job->error) std::rethrow_exception(job->error);
  if (progress.is_none() || job->cancelled) return;
  last.fraction = last.total = 1;
  progress(last);
}

std::string path_of(const py::object& path) {
  const py::object bytes = py::module_::import_("os").attr("fsencode")(path);
  return py::cast<py::bytes>(bytes).c_str();
}

void add_offline(py::module_& module) {
  py::class_<CallProgress>(module, "Progress", "Progress of a long call, passed to `progress`.")
      .def_ro("total", &CallProgress::total,
              "[0, 1] of the whole call, an estimate that never falls; 1 in the last call.")
      .def_ro("stage", &Progress::stage,
              "'polygonise', 'resolve', 'pack', 'calibrate', 'cover', 'tree' or 'predict'.")
      .def_ro("spheres", &Progress::spheres, "Number of spheres so far.")
      .def_ro("coverage", &Progress::coverage,
              "[0, 1] of the solid's volume in inner spheres; 'pack' only.")
      .def_ro("radius", &Progress::radius, "[u] radius of the spheres being inserted; 'pack' only.")
      .def_ro("fraction", &Progress::fraction, "[0, 1] of this stage's work, an estimate.")
      .def_ro("elapsed", &Progress::elapsed, "[s] since the stage began.");
  py::module_::import_("atexit").attr("register")(py::cpp_function([] {
    const py::gil_scoped_release released;
    while (const int left = running()) running().wait(left);
  }));
}

}  // namespace ist::python
