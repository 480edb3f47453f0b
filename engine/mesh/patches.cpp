// SPDX-License-Identifier: MIT
#include "engine/mesh/patches.h"

#include "engine/core/errors.h"

namespace rattan {

std::uint64_t PatchJoiner::add(const std::vector<Patch>& patches) {
  const std::uint64_t first = patches_.size();
  patches_.insert(patches_.end(), patches.begin(), patches.end());
  return first;
}

void PatchJoiner::begin_joining() {
  ensure(patches_.size() < 0xffffffffU, "patches are numbered by 32 bits");
  sets_.reset(static_cast<std::uint32_t>(patches_.size()));
}

void PatchJoiner::join(std::uint64_t patch_a, std::uint64_t patch_b) {
  const auto a = static_cast<std::uint32_t>(patch_a >> 1);
  const auto b = static_cast<std::uint32_t>(patch_b >> 1);
  if (!sets_.unite(a, b, static_cast<std::uint32_t>((patch_a ^ patch_b) & 1))) {
    patches_[a].conflict = true;
  }
}

std::vector<PatchFate> PatchJoiner::resolve() {
  struct Component {
    std::uint64_t plain = 0;
    std::uint64_t turned = 0;
    std::uint32_t first_parity = 2;  // 2: no owned triangle seen yet
    bool conflict = false;
  };
  const auto n = static_cast<std::uint32_t>(patches_.size());
  std::vector<Component> components(n);
  for (std::uint32_t p = 0; p < n; ++p) {
    const auto [root, parity] = sets_.find(p);
    Component& c = components[root];
    const Patch& patch = patches_[p];
    c.plain += parity == 0 ? patch.plain : patch.turned;
    c.turned += parity == 0 ? patch.turned : patch.plain;
    c.conflict = c.conflict || patch.conflict;
    if (c.first_parity == 2 && patch.plain + patch.turned > 0) {
      c.first_parity = patch.first_parity ^ parity;
    }
  }
  components_ = 0;
  one_sided_ = 0;
  std::vector<PatchFate> fates(n);
  for (std::uint32_t p = 0; p < n; ++p) {
    const auto [root, parity] = sets_.find(p);
    const Component& c = components[root];
    components_ += root == p ? 1 : 0;
    one_sided_ += root == p && c.conflict ? 1 : 0;
    const bool flip_plain = c.turned > c.plain || (c.turned == c.plain && c.first_parity == 1);
    fates[p] = {flip_plain != (parity == 1), c.conflict};
  }
  return fates;
}

}  // namespace rattan
