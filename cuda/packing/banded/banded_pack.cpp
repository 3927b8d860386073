#include "cuda/packing/banded/banded_pack.h"

#include <chrono>
#include <thread>

#include "cuda/base/device_array.h"
#include "cuda/packing/banded/banded_buffers.h"
#include "cuda/packing/banded/banded_kernel.h"
#include "packing/base/packing_settings.h"

namespace ist::gpu {
namespace {

/// The host's side of a packing with a progress callback: reports progress while the kernel runs,
/// and requests it to stop.
class Watch {
 public:
  Watch(const packing::PackingLimits& limits, Stage& stage) : schedule_(limits), stage_(stage) {
    if (!stage.watched()) return;
    void* memory = nullptr;
    check(cudaHostAlloc(&memory, sizeof(Mailbox), cudaHostAllocMapped | cudaHostAllocPortable),
          "allocating pinned host memory");
    mailbox_ = new (memory) Mailbox{};
  }
  ~Watch() {
    if (mailbox_ != nullptr) cudaFreeHost(mailbox_);
  }
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;

  Mailbox* mailbox() const { return mailbox_; }

  void wait(Queue& queue) {
    if (mailbox_ == nullptr) return queue.wait();
    for (;;) {
      const cudaError_t status = cudaStreamQuery(queue.stream());
      if (status != cudaErrorNotReady) {
        check(status, "packing");
        return;
      }
      look();
      // Polls at first; a long packing need not occupy a core.
      if (stage_.elapsed() > 0.05) std::this_thread::sleep_for(std::chrono::microseconds(500));
    }
  }

 private:
  void look() {
    try {
      const auto why = stage_.stop([this](Progress& now) {
        schedule_.covered = mailbox_->covered;
        packing::set_progress(now, schedule_.limits, mailbox_->spheres, schedule_.coverage(),
                              double{mailbox_->radius});
      });
      if (why) stop(*why);
    } catch (...) {
      stop(StopReason::cancelled);
      throw;
    }
  }

  void stop(StopReason why) {
    if (mailbox_->stop == 0) mailbox_->stop = 1 + static_cast<std::uint32_t>(why);
  }

  packing::BandSchedule schedule_;  ///< for the coverage alone
  Stage& stage_;
  Mailbox* mailbox_ = nullptr;
};

}  // namespace

SpherePacking pack_banded(Queue& queue, const WideTree& mesh, const packing::PackingLimits& limits,
                          Stage& stage) {
  BandedBuffers<DeviceArray, Queue> buffers(queue, packing::BandSchedule(limits),
                                            banded_sizes(limits.max_spheres));
  DeviceArray<CoopBarrier> barrier(queue, 1);
  barrier.fill_bytes(0);
  Watch watch(limits, stage);
  BandedState state;
  try {
    for (;;) {
      BandedArrays arrays = buffers.arrays();
      arrays.mailbox = watch.mailbox();
      launch_banded(queue, arrays, mesh, barrier.data());
      watch.wait(queue);
      state = buffers.state();
      if (state.need == Need::nothing) break;
      buffers.provide(state);
    }
  } catch (...) {
    cudaStreamSynchronize(queue.stream());  // the kernel may still write to the mailbox
    throw;
  }
  return buffers.result(state);
}

}  // namespace ist::gpu
