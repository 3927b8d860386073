#pragma once

#include <cuda_runtime_api.h>

#include <cstddef>

#include "cuda/query/exact_arrays.h"
#include "cuda/query/patch_memory.h"
#include "cuda/query/separation_arrays.h"
#include "cuda/query/triangle_steps.h"

// The functions that launch a batch's kernels. None of them waits.

namespace ist::gpu {

struct TriangleGrids {
  int walk, sum, rest;
};

struct ExactGrids {
  int search;
  int kept[2];  ///< of searches that keep candidates, and of those among kept ones
  int sum[2];   ///< by signs in doubles, and by exact ones
  int touch, whole;
};

struct MeshGapGrids {
  int glance;
  int search[2];  ///< with boxes in float, and in double
  int measure, finish;
};

/// The number of blocks of each kernel that the current device runs at a time.
struct Grids {
  int sum, details;  ///< of trees
  int search[2];     ///< of separations, in float and in double
  MeshGapGrids mesh_gaps;
  int divide;            ///< of contact patches
  int divide_meshes;     ///< of contact patches by Measure::exact
  int smooth;            ///< of trees in smooth fields
  TriangleGrids facets;  ///< of trees in boxes and terrains
  ExactGrids exact;
};

/// Each function sets the members of its own kernels.
void find_batch_grids(Grids& grids);
void find_separation_grids(Grids& grids);
void find_patch_grids(Grids& grids);
void find_field_grids(Grids& grids);
void find_exact_grids(Grids& grids);
void find_exact_patch_grids(Grids& grids);

void launch_batch(const BatchArrays& batch, const Grids& grids, cudaStream_t stream);
/// `kept` may be null.
void launch_exact(const ExactArrays& batch, const ExactKept* kept, const Grids& grids,
                  cudaStream_t stream);
void launch_exact_patches(const ExactPatchArrays& batch, const Grids& grids, cudaStream_t stream);
/// True if a batch's memory suffices for its largest mesh.
bool has_memory(const ExactArrays& batch);
bool has_memory(const ExactPatchArrays& batch);
/// [bytes] of memory with which all teams work on a batch of up to `most_pairs`. Less is slower.
std::size_t exact_memory_bytes(const Grids& grids, std::size_t most_pairs);
/// `has_spheres`: some solids have no mesh. `has_meshes`: some have one.
void launch_separations(const SeparationArrays& batch, const Grids& grids, bool has_spheres,
                        bool has_meshes, cudaStream_t stream);
/// `memory_bytes` limits the number of teams that divide contacts.
void launch_patches(const PatchArrays& batch, const Grids& grids, std::size_t memory_bytes,
                    cudaStream_t stream);
/// `has`: true for groups that have fields.
void launch_field_batch(const FieldBatch& batch, const bool (&has)[kFieldGroups],
                        const Grids& grids, cudaStream_t stream);

}  // namespace ist::gpu
