// Copyright 2026 The stickslip_ros maintainers
// SPDX-License-Identifier: Apache-2.0

// How the search of the site ranks: Sphinx's own numbers; studies and decisions come last.
var Scorer = {
  score: ([docname, , , , score]) =>
    /^(studies|explanation\/decisions)\//.test(docname) ? score - 1000 : score,
  objNameMatch: 11,
  objPartialMatch: 6,
  objPrio: { 0: 15, 1: 5, 2: -5 },
  objPrioDefault: 0,
  title: 15,
  partialTitle: 7,
  term: 5,
  partialTerm: 2,
};
