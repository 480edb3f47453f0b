// SPDX-License-Identifier: MIT
#pragma once

// Passes over the tiles of one level. Every function visits each tile `passes` times (once unless
// said otherwise); values beyond a tile's own come from the board of the previous pass.

#include "engine/solve/sweeps.h"

namespace rattan {

enum class Start {
  kSeed,  ///< unit values from a hash of the node's number
  kZero,
  kStored,   ///< what the field holds
  kProlong,  ///< from the coarser level: x_i = G_i x_parent
  kCorrect,  ///< base + step (stored - base), plus kProlong: see SmoothPlan::step
};

struct Evaluation {
  double energy = 0.0;
  double energy_unit = 0.0;  ///< with complex parts set to unit length
  double gradient_norm = 0.0;
  /// What the squares of fit - target hold beside the quadratic form (finest level): with it the
  /// energy of targets met is zero.
  double targets = 0.0;
};

template <class Block>
struct SmoothPlan {
  Start start = Start::kStored;
  std::uint64_t seed = 0;  ///< of kSeed
  int passes = 1;
  int sweeps = 1;          ///< in each tile, each pass
  int unit_sweeps = 0;     ///< more of them at unit norm in the last pass
  bool symmetric = false;  ///< forward and backward in turn
  bool normalise = false;  ///< complex parts to unit length at the end
  /// Where named, the last pass writes the parts' lengths as they are before sweeps at unit norm.
  Field<PartNorms> norms{};
  float omega = 1.0F;
  SweepMode mode = SweepMode::kPenalty;
  float penalty = 0.0F;                      ///< eps of one vertex of the scan
  Field<Value<Block>> values{};              ///< read (kStored) and written
  HaloBoard<Value<Block>>* board = nullptr;  ///< of `values`
  Field<Value<Block>> rhs{};                 ///< instead of the system's, if named
  Field<Value<Block>> coarse_values{};       ///< kProlong: the coarser level's field
  /// Inner products of the result with these fields, where named.
  std::array<Field<Value<Block>>, 2> dot_with{};
  /// kCorrect: `base` stands for zero where it has no name, and holds where the pass started from,
  /// before prolongation, unless the pass is `final`.
  float step = 1.0F;
  bool based = false;  ///< `base` is there already
  bool final = false;
  Field<Value<Block>> base{};
  HaloBoard<Value<Block>>* base_board = nullptr;
  /// The last pass hands its results to hooks->consume, if that is set, and doesn't write them.
  SolveHooks<Block>* hooks = nullptr;
  /// Filled in by the last pass, where not null: for real blocks and with `normalise`. The gradient
  /// is that of each tile among its neighbours' values before the pass.
  Evaluation* evaluation = nullptr;
};

/// Lengths of the complex parts of the first `count` values.
template <class Block>
std::vector<PartNorms> part_norms(std::span<const Value<Block>> x, std::size_t count);

/// Visits every tile plan.passes times. Returns the inner products that the plan asks for.
template <class Block>
std::array<double, 2> smooth(SystemLevel<Block>& fine, const SystemLevel<Block>* coarse,
                             const SmoothPlan<Block>& plan, TaskGraph& tasks);

/// Values of a tile's owned nodes prolonged from the coarse tile's (owned) values.
template <class Block>
std::vector<Value<Block>> prolong_owned(const TileSystem<Block>& tile,
                                        std::span<const Value<Block>> coarse);

/// Sums of a tile's values in their parents' gauges: one per aggregate of the tile.
template <class Block>
std::vector<Value<Block>> restrict_owned(const TileSystem<Block>& tile, std::uint32_t first_parent,
                                         std::uint32_t parents,
                                         std::span<const Value<Block>> values);

/// Joins the pieces of consecutive tiles into chunks of coarse tiles; call add() in tile order.
template <class Block>
class CoarseWriter {
 public:
  CoarseWriter(const SystemLevel<Block>& fine, const SystemLevel<Block>& coarse,
               Field<Value<Block>> field)
      : fine_(fine), coarse_(coarse), field_(field) {}
  void add(TileId tile, const std::vector<Value<Block>>& piece);

 private:
  const SystemLevel<Block>& fine_;
  const SystemLevel<Block>& coarse_;
  Field<Value<Block>> field_;
  std::vector<Value<Block>> chunk_;
};

/// Restricts the field of every level from `from` (whose field must be there) to the coarsest.
template <class Block>
void restrict_down(SystemHierarchy<Block>& system, std::size_t from,
                   Field<Value<Block>> SystemLevel<Block>::*field, TaskGraph& tasks);
/// Restricts the field of level k to level k + 1.
template <class Block>
void restrict_once(SystemHierarchy<Block>& system, std::size_t k,
                   Field<Value<Block>> SystemLevel<Block>::*field, TaskGraph& tasks);

/// Energy and gradient of a level's stored solution.
template <class Block>
Evaluation evaluate(const SystemLevel<Block>& s, float penalty, TaskGraph& tasks);

}  // namespace rattan
