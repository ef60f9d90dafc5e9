/** What a job's fitness is, by the kind of job. */

import type { Job, StoredJob } from '../api/types'

/**
 * Unit of a job's fitness: the product that tunes a drive has none, nor has a misfit
 * in tolerances; an identification's is a mean of its objectives, which are currents.
 */
export function fitnessUnit({
  kind,
  objectives,
}: {
  /** Null for a job that cannot be read. */
  readonly kind: StoredJob['kind']
  /** Summaries are without them. */
  readonly objectives?: Job['objectives']
}): string {
  return kind !== 'identification' ? '1' : (objectives?.[0]?.unit ?? 'A')
}

/** What the parts of a fitness are called. */
export interface CaseWords {
  /** One walk of which several are judged, and several. */
  readonly one: string
  readonly many: string
  /** What a walk is worth. */
  readonly worth: string
}

export function caseWords(kind: Job['kind']): CaseWords {
  switch (kind) {
    case 'tuning':
      return { one: 'scenario', many: 'scenarios', worth: 'utility' }
    case 'identification':
      return { one: 'recording', many: 'recordings', worth: 'error' }
    case 'calibration':
      return { one: 'walk', many: 'walks', worth: 'misfit' }
  }
}
