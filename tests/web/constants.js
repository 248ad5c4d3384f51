// Numbers and names that Python has too.
import * as actions from "touchdown/common/actions.js";
import { STEPS_PER_SECOND } from "touchdown/common/units.js";
import { MAX_STEPS } from "touchdown/play/commands.js";
import { MAX_SEED, YOU } from "touchdown/play/link.js";
import { OUTCOME_COLOURS } from "touchdown/scene/dials.js";

export function constants() {
  const engines = { ...actions };
  return { engines, STEPS_PER_SECOND, MAX_STEPS, MAX_SEED, YOU, OUTCOME_COLOURS };
}
