#pragma once

#include "c_api/structs.h"
#include "query/base/no_answer.h"

// Shared by all queries of the C functions.

namespace ist::c_api {

/// Reads what every query has, then runs `ask(a, b, workspace)`, which returns its status. `Solid`:
/// PlacedSolid, or PlacedAsset where only assets have an answer.
template <class Solid, class Ask>
ist_status_t ask_about(const ist_placed_t* a, const ist_placed_t* b, ist_workspace_t* workspace,
                       const Ask& ask) noexcept {
  Solid first, second;
  ist_status_t status = read(a, first);
  if (status == IST_OK) status = read(b, second);
  if (status != IST_OK) return status;
  Workspace* const scratch = workspace_of(workspace, status);
  return scratch == nullptr ? status : ask(first, second, *scratch);
}

/// An answer to a refused query: all numbers are NaN, as in an unanswerable one.
template <class Found, class Answer>
ist_status_t refuse(ist_status_t status, Answer& answer) noexcept {
  write(invalid_input<Found>(), answer);
  return answer.status = status;
}

/// A query with settings and one answer: `ask(a, b, settings, workspace)` finds it, a `Found`.
template <class Settings, class Found, class Given, class Answer, class Ask>
ist_status_t answer_with(const ist_placed_t* a, const ist_placed_t* b, const Given* given,
                         ist_workspace_t* workspace, Answer* answer, const Ask& ask) noexcept {
  ist_status_t status = check_size(answer);
  if (status != IST_OK) return status;
  Settings settings;
  status = read(given, settings);
  if (status == IST_OK)
    status =
        ask_about<PlacedSolid>(a, b, workspace, [&](const auto& x, const auto& y, auto& scratch) {
          write(ask(x, y, settings, scratch), *answer);
          return ist_status_t{IST_OK};
        });
  return status == IST_OK ? answer->status : refuse<Found>(status, *answer);
}

}  // namespace ist::c_api
