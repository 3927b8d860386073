#include "bake/backend/make_backend.h"

#include "bake/backend/host_backend.h"
#include "cuda/cuda_backend.h"

namespace ist {

// The one place that knows which backends there are.
std::unique_ptr<SolidBackend> make_backend(const Solid& solid, const BackendChoice& choice) {
  const bool on_gpu = solid.mesh() != nullptr &&
                      (choice.device == Device::cuda ||
                       (choice.device == Device::automatic && gpu_available(choice.gpu.device)));
  return on_gpu ? gpu::make_cuda_backend(*solid.mesh(), choice.gpu) : make_host_backend(solid);
}

}  // namespace ist
