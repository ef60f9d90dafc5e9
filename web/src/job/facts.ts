/** Facts about a job: state, budget, fitness, priority, start and searched variables. */

import type {
  AnySpec,
  Iteration,
  Job,
  JobState,
  JobSummary,
  StoredJob,
  Variable,
} from '../api/types'
import { formatCount } from '../format/number'
import type { Design } from '../format/value'

interface WithState {
  readonly state: JobState
}

export function hasEnded({ state }: WithState): boolean {
  return state === 'succeeded' || state === 'failed' || state === 'cancelled'
}

/** Whether the job will progress without a command. */
export function isActive(job: WithState): boolean {
  return job.state === 'queued' || isRunning(job)
}

export function isRunning({ state }: WithState): boolean {
  return state === 'running' || state === 'pausing'
}

/** `running 24/48`, in evaluations, or the final state. followed: iterations from the stream. */
export function progressInWords(
  job: Counts & WithState,
  followed: readonly Iteration[] = [],
): string {
  const { done, planned } = budgetSpent(job, followed)
  return hasEnded(job) ? job.state : `${job.state} ${done}/${planned}`
}

/** Evaluations done, and planned. */
export interface Spent {
  readonly done: number
  readonly planned: number
}

export type Counts = Pick<JobSummary, 'iterations' | 'evaluations' | 'evaluations_planned'>

/** followed: iterations received from the stream, which may be ahead of the job. */
export function budgetSpent(job: Counts, followed: readonly Iteration[] = []): Spent {
  const ahead = followed.length > job.iterations
  const done = ahead ? followed.reduce((sum, { designs }) => sum + designs, 0) : job.evaluations
  return { done, planned: job.evaluations_planned }
}

/** `12 of 25 evaluations`. */
export function spentInWords({ done, planned }: Spent): string {
  return `${formatCount(done)} of ${formatCount(planned)} evaluations`
}

/** Unit of a job's fitness: dimensionless, except for identification, which averages errors in current. */
export function fitnessUnit({
  kind,
  objectives,
}: {
  readonly kind: StoredJob['kind']
  /** Missing in summaries. */
  readonly objectives?: Job['objectives']
}): string {
  return kind !== 'identification' ? '1' : (objectives?.[0]?.unit ?? 'A')
}

/** Terms for what is evaluated and its measure, and how the fitness combines the measures. */
function terms(item: string, measure: string, measures: string, note: string) {
  return { item, items: `${item}s`, measure, measures, note }
}

const MEAN = 'The fitness is their mean'
const SCENARIOS = terms('scenario', 'utility', 'utilities', MEAN)
const WORDS: Readonly<Partial<Record<Job['kind'], typeof SCENARIOS>>> = {
  identification: terms('recording', 'error', 'errors', MEAN),
  calibration: terms(
    'walk',
    'misfit',
    'misfits',
    'Root mean square of the deviations from the fitted targets of a walk, in tolerances',
  ),
}

export function caseWords(kind: Job['kind']): typeof SCENARIOS {
  return WORDS[kind] ?? SCENARIOS
}

export const LOWEST = -10
export const HIGHEST = 10

export const PRIORITY_HELP =
  'Queued jobs start in order of priority. Among running jobs, each step doubles the share of the' +
  ' workers. Results do not depend on it.'

export const PRIORITY_ERROR = `must be an integer from ${LOWEST} to ${HIGHEST}`

export function isPriority(text: string): boolean {
  const priority = Number(text)
  const whole = text.trim() !== '' && Number.isInteger(priority)
  return whole && LOWEST <= priority && priority <= HIGHEST
}

/** Start designs; references to jobs were resolved to designs when the job was stored. */
export function startDesigns({ spec }: { readonly spec: AnySpec }): readonly Design[] {
  return Array.isArray(spec.start) ? (spec.start as readonly Design[]) : []
}

export function searchedVariables(spec: Job['spec']): readonly Variable[] {
  // Presets are resolved in a stored spec.
  return (spec.variables ?? []).filter((v): v is Variable => typeof v !== 'string')
}
