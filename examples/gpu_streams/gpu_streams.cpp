// Bakes several meshes at once on one GPU: a host thread and a stream each, all of them from one
// memory resource that keeps to a limit. usage: gpu_streams MIB MESH…

#include <cuda_runtime_api.h>
#include <ist/bake.h>
#include <ist/gpu.h>
#include <ist/types.h>

#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>
#include <vector>

namespace {

/// Stream-ordered device memory, no more than `limit` bytes at a time.
class LimitedMemory final : public ist::DeviceMemoryResource {
 public:
  explicit LimitedMemory(std::size_t limit) : limit_(limit) {}

  void* allocate(std::size_t bytes, CUstream_st* stream) override {
    if (used_.fetch_add(bytes) + bytes <= limit_) {
      void* memory = nullptr;
      if (cudaMallocAsync(&memory, bytes, stream) == cudaSuccess) return memory;
    }
    used_.fetch_sub(bytes);
    return nullptr;  // the bake ends with an ist::Error that says so
  }

  void deallocate(void* memory, std::size_t bytes, CUstream_st* stream) noexcept override {
    cudaFreeAsync(memory, stream);
    used_.fetch_sub(bytes);
  }

 private:
  std::size_t limit_;
  std::atomic<std::size_t> used_ = 0;
};

void bake_on_stream(const std::string& path, ist::DeviceMemoryResource& memory) {
  cudaStream_t stream = nullptr;
  if (cudaStreamCreateWithFlags(&stream, cudaStreamNonBlocking) != cudaSuccess) return;
  try {
    ist::PackingSettings settings;
    settings.max_spheres = 2'000;
    settings.device = ist::Device::cuda;
    settings.gpu = {.device = 0, .stream = stream, .memory = &memory};
    ist::bake(ist::close_mesh(ist::load_mesh(path), path), settings).save(path + ".ist");
    std::printf("%s.ist\n", path.c_str());
  } catch (const ist::Error& error) {
    std::fprintf(stderr, "%s: %s\n", path.c_str(), error.what());
  }
  cudaStreamDestroy(stream);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) return std::fprintf(stderr, "usage: gpu_streams MIB MESH...\n"), 2;
  std::string why;
  if (!ist::gpu_available(0, &why)) return std::printf("nothing baked: %s\n", why.c_str()), 0;
  LimitedMemory memory(std::strtoull(argv[1], nullptr, 10) << 20);
  std::vector<std::thread> threads;
  for (int i = 2; i < argc; ++i)
    threads.emplace_back([&memory, path = std::string(argv[i])] { bake_on_stream(path, memory); });
  for (std::thread& thread : threads) thread.join();
}
