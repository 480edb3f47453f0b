// SPDX-License-Identifier: MIT
#include <algorithm>
#include <limits>

#include "engine/solve/hierarchy.h"

namespace rattan {

namespace {

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

// A pair takes in neighbours that found no mate up to this size.
constexpr std::size_t kMostOfPair = 4;

// The members of a pair, ascending.
struct Pair {
  std::array<std::uint32_t, kMostOfPair> member{};
  std::size_t size = 0;
  std::span<const std::uint32_t> members() const { return {member.data(), size}; }
  void insert(std::uint32_t i) {
    std::size_t k = size++;
    for (; k > 0 && member[k - 1] > i; --k) {
      member[k] = member[k - 1];
    }
    member[k] = i;
  }
};

// Attaches the members of one aggregate to its root by strongest edges first (Prim, a few nodes).
void grow_tree(std::span<const std::uint32_t> members, std::span<const std::uint32_t> row_begin,
               std::span<const std::uint32_t> neighbor, std::span<const float> weight,
               std::vector<std::uint32_t>& tree) {
  tree[members[0]] = members[0];
  for (std::size_t attached = 1; attached < members.size(); ++attached) {
    std::uint32_t best = kNone;
    std::uint32_t via = kNone;
    float best_weight = -1.0F;
    for (const std::uint32_t m : members.subspan(1)) {
      if (tree[m] != kNone) {
        continue;
      }
      for (std::uint32_t e = row_begin[m]; e < row_begin[m + 1]; ++e) {
        const std::uint32_t j = neighbor[e];
        if (weight[e] > best_weight &&
            std::find(members.begin(), members.end(), j) != members.end() && tree[j] != kNone) {
          best = m;
          via = j;
          best_weight = weight[e];
        }
      }
    }
    tree[best] = via;
  }
}

}  // namespace

Matching match_twice(std::span<const std::uint32_t> row_begin,
                     std::span<const std::uint32_t> neighbor, std::span<const float> weight) {
  const auto n = static_cast<std::uint32_t>(row_begin.size() - 1);
  Matching out;
  out.aggregate.assign(n, kNone);
  out.tree.assign(n, kNone);

  // First round: pairs, numbered by their lower member. Nodes that find no mate, because all their
  // neighbours have one, join the pair they hang on to most; left alone, they would be left at
  // every level, and the coarsest would grow with the scan.
  std::vector<std::uint32_t> pair_of(n, kNone);
  std::vector<Pair> pairs;
  pairs.reserve(n / 2 + n / 8);
  for (std::uint32_t i = 0; i < n; ++i) {
    if (pair_of[i] != kNone) {
      continue;
    }
    std::uint32_t mate = kNone;
    std::uint32_t host = kNone;
    float best = 0.0F;
    float best_host = 0.0F;
    for (std::uint32_t e = row_begin[i]; e < row_begin[i + 1]; ++e) {
      const std::uint32_t j = neighbor[e];
      if (j >= n || j == i) {
        continue;
      }
      if (pair_of[j] == kNone) {
        if (weight[e] > best) {
          mate = j;
          best = weight[e];
        }
      } else if (weight[e] > best_host && pairs[pair_of[j]].size < kMostOfPair) {
        host = pair_of[j];
        best_host = weight[e];
      }
    }
    if (mate == kNone && host != kNone) {
      pair_of[i] = host;
      pairs[host].insert(i);
      continue;
    }
    const auto p = static_cast<std::uint32_t>(pairs.size());
    Pair& made = pairs.emplace_back();
    made.insert(i);
    pair_of[i] = p;
    if (mate != kNone) {
      made.insert(mate);
      pair_of[mate] = p;
    }
  }

  // Second round: pairs of pairs, by the sum of the weights between them.
  const auto pair_count = static_cast<std::uint32_t>(pairs.size());
  std::vector<float> between(pair_count, 0.0F);
  std::vector<std::uint32_t> touched;
  for (std::uint32_t p = 0; p < pair_count; ++p) {
    if (out.aggregate[pairs[p].member[0]] != kNone) {
      continue;
    }
    touched.clear();
    for (const std::uint32_t i : pairs[p].members()) {
      for (std::uint32_t e = row_begin[i]; e < row_begin[i + 1]; ++e) {
        const std::uint32_t j = neighbor[e];
        if (j >= n || out.aggregate[j] != kNone || weight[e] <= 0.0F) {
          continue;
        }
        const std::uint32_t q = pair_of[j];
        if (q != p) {
          if (between[q] == 0.0F) {
            touched.push_back(q);
          }
          between[q] += weight[e];
        }
      }
    }
    std::uint32_t mate = kNone;
    float best = 0.0F;
    for (const std::uint32_t q : touched) {
      if (between[q] > best || (between[q] == best && q < mate)) {
        mate = q;
        best = between[q];
      }
      between[q] = 0.0F;
    }
    std::array<std::uint32_t, 2 * kMostOfPair> members{};
    std::size_t size = 0;
    for (const std::uint32_t q : {p, mate}) {
      if (q == kNone) {
        continue;
      }
      for (const std::uint32_t i : pairs[q].members()) {
        out.aggregate[i] = out.count;
        members[size++] = i;
      }
    }
    grow_tree(std::span(members.data(), size), row_begin, neighbor, weight, out.tree);
    ++out.count;
  }
  return out;
}

}  // namespace rattan
