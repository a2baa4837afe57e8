// SPDX-License-Identifier: MIT
//
// Polytopes cut into simplices by what their facets have in common, without coordinates: pulling
// triangulations (De Loera, Rambau and Santos, Triangulations, 2010, section 4.3.1).
module cilantro.spatial:pulling;

import cilantro.standard;
import cilantro.core;
import :polytope_data;

namespace cilantro {

/// The facets of a polytope of dimension k, by their corners, which are those that it shares with
/// each of the others around it. All lists are ascending.
std::vector<index_list> shared_faces(const index_list& corners,
                                     const std::vector<index_list>& others, index_t k) {
  std::vector<index_list> faces;
  for (const auto& other : others) {
    index_list common;
    std::ranges::set_intersection(corners, other, std::back_inserter(common));
    if (std::ssize(common) >= std::max<index_t>(1, k) && common.size() < corners.size())
      faces.push_back(std::move(common));
  }
  // Where faces of less dimensions have as many corners, those are facets that no other face holds.
  if (k >= 4)
    std::erase_if(faces, [&, all = faces](const index_list& face) {
      return std::ranges::any_of(all, [&](const index_list& other) {
        return face.size() < other.size() && std::ranges::includes(other, face);
      });
    });
  std::ranges::sort(faces);
  faces.erase(std::ranges::unique(faces).begin(), faces.end());
  return faces;
}

/// Cuts a polytope of dimension k, given by its corners and those of its facets, all ascending,
/// into simplices that all have its first corner. Facets are cut in the same way, so that those of
/// two polytopes that share a facet fit.
void pull(const index_list& corners, const std::vector<index_list>& facets, index_t k,
          index_list& prefix, index_list& out) {
  if (std::ssize(corners) == k + 1) {
    out.insert(out.end(), prefix.begin(), prefix.end());
    out.insert(out.end(), corners.begin(), corners.end());
    return;
  }
  // No polytope of that dimension: what is missing then, the caller finds.
  if (k < 1 || std::ssize(corners) <= k) return;
  prefix.push_back(corners[0]);
  for (const auto& facet : facets) {
    if (facet[0] == corners[0]) continue;
    std::vector<index_list> ridges;
    if (std::ssize(facet) > k) ridges = shared_faces(facet, facets, k - 1);
    pull(facet, ridges, k - 1, prefix, out);
  }
  prefix.pop_back();
}

/// Simplices one after the other, and the facet that each is a part of.
struct simplex_list {
  index_list corners;
  index_list facets;
};
/// The boundary of a bounded polytope of dimension d as simplices, d corners each. Facets are
/// ascending.
simplex_list pulled_boundary(const lists_of_indices& facets, index_t d) {
  const auto corner_count =
      facets.values.empty() ? 0 : index_t{std::ranges::max(facets.values)} + 1;
  std::vector<index_list> meeting(corner_count);
  for (index_t f = 0; f < facets.size(); ++f)
    for (const auto g : facets[f]) meeting[g].push_back(static_cast<std::int32_t>(f));
  simplex_list simplices;
  index_list prefix, shared(facets.size(), 0);
  for (index_t f = 0; f < facets.size(); ++f) {
    const index_list corners(facets[f].begin(), facets[f].end());
    std::vector<index_list> others;
    if (std::ssize(corners) > d) {
      index_list near;
      for (const auto g : corners)
        for (const auto other : meeting[g])
          if (other != f && ++shared[other] == d - 1) near.push_back(other);
      for (const auto g : corners)
        for (const auto other : meeting[g]) shared[other] = 0;
      for (const auto other : near) others.emplace_back(facets[other].begin(), facets[other].end());
    }
    pull(corners, shared_faces(corners, others, d - 1), d - 1, prefix, simplices.corners);
    simplices.facets.resize(std::ssize(simplices.corners) / d, static_cast<std::int32_t>(f));
  }
  return simplices;
}

/// Whether simplices of d corners each close up: whether each face of theirs belongs to two.
bool closes_up(const index_list& simplices, index_t d) {
  const index_t count = std::ssize(simplices) / d;
  if (count == 0) return false;
  index_list faces;
  faces.reserve(count * d * (d - 1));
  for (index_t s = 0; s < count; ++s) {
    index_list corners(simplices.begin() + s * d, simplices.begin() + (s + 1) * d);
    std::ranges::sort(corners);
    for (index_t left_out = 0; left_out < d; ++left_out)
      for (index_t k = 0; k < d; ++k)
        if (k != left_out) faces.push_back(corners[k]);
  }
  const auto face = [&](index_t i) {
    return std::span{faces}.subspan(i * (d - 1), static_cast<std::size_t>(d - 1));
  };
  std::vector<index_t> order(count * d);
  for (index_t i = 0; i < std::ssize(order); ++i) order[i] = i;
  std::ranges::sort(order, [&](index_t a, index_t b) {
    return std::ranges::lexicographical_compare(face(a), face(b));
  });
  for (std::size_t begin = 0, end = 0; begin < order.size(); begin = end) {
    while (end < order.size() && std::ranges::equal(face(order[begin]), face(order[end]))) ++end;
    if (end - begin != 2) return false;
  }
  return true;
}

}  // namespace cilantro
