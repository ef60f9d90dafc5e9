/** The result of a tuning job at a glance: verdict, key figures, walk and next step. */

import type { Job, QuantityChange, Verdict } from '../../api/types'
import { CopyBlock } from '../../components/copy-button'
import { formatCount, percent, quantity } from '../../format/number'
import { jobPath, withQuery } from '../../router/routes'
import { CertifyButton } from '../certificate/certify'
import { hasEnded, searchedVariables } from '../facts'
import type { Gain } from '../gain'
import { amountOf, MARKS } from '../quantity'
import { WalkPoster } from './poster'
import './hero.css'
import '../../walk/player/walk-stage.css'

export function Hero({ job, gain }: { job: Job; gain: Gain & { verdict: Verdict | null } }) {
  const { verdict } = gain
  const [lead, ...others] = (verdict?.sentences ?? []).filter(
    (text) => !text.startsWith('At a bound'),
  )
  return (
    <section class="hero" aria-label="Verdict" data-better={verdict?.figures.better ?? 0}>
      <div class="hero-words">
        <h2 aria-live="polite">{headline(job, gain)}</h2>
        {lead && <p>{lead}</p>}
        {hasEnded(job) && job.best_fitness === null && !verdict?.relax && (
          <p>
            The table of <a href={jobPath(job.id, 'iterations')}>iterations</a> shows why designs
            fail. Search within other bounds, or in easier scenarios.
          </p>
        )}
        {verdict?.relax && (
          <CopyBlock
            label="the command that continues under relaxed constraints"
            text={`${verdict.relax} --server ${location.origin}`}
          />
        )}
        {others.length > 0 && (
          <details>
            <summary>In detail</summary>
            <ul>
              {others.map((text) => (
                <li key={text}>{text}</li>
              ))}
            </ul>
          </details>
        )}
      </div>
      {job.best && <WalkPoster job={job} />}
      {job.best && <Figures job={job} gain={gain} />}
      {job.best && hasEnded(job) && <NextStep job={job} verdict={verdict} />}
    </section>
  )
}

function headline(job: Job, { reference, share, reason }: Gain): string {
  const soFar = hasEnded(job) ? '' : ' so far'
  if (job.best_fitness === null) {
    return hasEnded(job)
      ? 'No design walks in every scenario'
      : 'No design walks in every scenario yet'
  }
  if (reference === null || share === null) {
    return `Best fitness${soFar}: ${quantity(job.best_fitness, '1', 4)}${reason ? `; ${reason}` : ''}`
  }
  if (Math.abs(share) < SAME) return `As good as ${reference.label}${soFar}`
  return `${percent(Math.abs(share), 2)} ${share > 0 ? 'better' : 'worse'} than ${reference.label}${soFar}`
}

/** Relative difference up to which two values are the same, as in the API's verdict. */
const SAME = 0.005

const FIGURES = [
  ['speed', 'Speed', 'm/s'],
  ['energy', 'Energy per metre', 'J/m'],
  ['peak_current', 'Peak current', 'A'],
  ['torque', 'Torque', 'N m'],
  ['acceleration', 'Acceleration', 'm/s2'],
] as const

/** Five figures of the best design, as means over the scenarios. */
function Figures({ job, gain }: { job: Job; gain: Gain & { verdict: Verdict | null } }) {
  const results = Object.entries(job.best!.scenarios)
  const count = results.length
  const weights = job.spec.kind === 'tuning' ? job.spec.scenario_weights : undefined
  const rows = FIGURES.flatMap(([name, label, unit]) => {
    const compared = gain.verdict?.quantities.find((each) => each.name === name)
    const value = compared
      ? geometricMean(
          Object.entries(compared.scenarios).map(([k, one]) => [one.value, weights?.[k]]),
        )
      : geometricMean(results.map(([k, one]) => [amountOf(one, { name }), weights?.[k]]))
    return value === null ? [] : [{ name, label, unit, value, compared }]
  })
  if (rows.length === 0) return null
  return (
    <div class="hero-figures">
      <dl>
        {rows.map(({ name, label, unit, value, compared }) => (
          <div key={name} data-figure={name}>
            <dt>{label}</dt>
            <dd>{quantity(value, unit, 3)}</dd>
            {compared && <Comparison name={name} compared={compared} value={value} unit={unit} />}
          </div>
        ))}
      </dl>
      <p class="muted small">
        Best design{count > 1 && `, mean of ${formatCount(count)} scenarios`}
        {gain.reference && `; compared with ${gain.reference.label}`}.
      </p>
    </div>
  )
}

interface ComparisonProps {
  name: string
  compared: QuantityChange
  value: number
  unit: string
}

function Comparison({ name, compared, value, unit }: ComparisonProps) {
  const [more, less] = name === 'speed' ? ['faster', 'slower'] : ['more', 'less']
  const { judgement, change: relative } = compared
  const size =
    judgement === 'same'
      ? 'the same'
      : `${percent(Math.abs(relative), 2)} ${relative > 0 ? more : less}`
  return (
    <dd
      class="judged"
      data-tone={judgement}
      title={`reference: ${quantity(value / (1 + relative), unit, 3)}`}
    >
      <b>{MARKS[judgement]}</b> {size}
    </dd>
  )
}

/** Null unless all values are positive; weights: 1 if missing. */
function geometricMean(
  values: readonly (readonly [value: number | null | undefined, weight?: number])[],
): number | null {
  let [sum, total] = [0, 0]
  for (const [value, weight = 1] of values) {
    if (typeof value !== 'number' || !(value > 0)) return null
    sum += weight * Math.log(value)
    total += weight
  }
  return total > 0 ? Math.exp(sum / total) : null
}

/** The most useful next command, and others. */
function NextStep({ job, verdict }: { job: Job; verdict: Verdict | null }) {
  const bounds = verdict?.bounds ?? []
  const widen = bounds
    .flatMap(({ name, widened }) => (widened ? [`${name}:${widened.low}:${widened.high}`] : []))
    .join()
  const widens = widen !== ''
  const variables = searchedVariables(job.spec).length
  return (
    <div class="next-step" data-active-bounds={bounds.map(({ name }) => name).join(' ')}>
      <p>
        <strong>Next: {widens ? 'search further' : 'test it'}.</strong>{' '}
        {widens
          ? `${formatCount(bounds.length)} of ${formatCount(variables)} variables of the best design are at a bound of the search. Better designs may lie beyond.`
          : 'The best design lies within the bounds. A certificate shows how often it fails in other worlds.'}
      </p>
      <div class="row">
        {widens && (
          <a class="button primary" href={withQuery('/jobs/new', { clone: job.id, widen })}>
            Widen and run again
          </a>
        )}
        <CertifyButton job={job} primary={!widens} />
        <a class="button" href={jobPath(job.id, 'firmware')}>
          Write firmware
        </a>
      </div>
    </div>
  )
}
