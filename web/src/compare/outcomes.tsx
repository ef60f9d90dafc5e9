/** Best designs of jobs next to each other: objectives by scenario, and walks. */

import { useRef, useState } from 'preact/hooks'
import type { Job, JobSpec } from '../api/types'
import { Card } from '../components/card'
import { Select } from '../components/fields/controls'
import { Table } from '../components/table/table'
import { Unit } from '../components/text'
import { useVisible } from '../components/use-visible'
import { change, formatNumber, NONE } from '../format/number'
import { placeWord } from '../format/place'
import { capitalized, inWords } from '../format/words'
import { amountOf, type Quantity, quantityOf } from '../job/quantity'
import { setQuery } from '../router/navigation'
import { RATE, WalkStage } from '../walk/player/walk-stage'
import { recordWalk } from '../walk/replay/replay'
import { JobName } from './charts'

/** scenario: empty for the mean over those that all jobs have. */
export function Outcomes({ jobs, scenario }: { jobs: readonly Job[]; scenario: string }) {
  const shared = sharedScenarios(jobs)
  const [running, setRunning] = useState(false)
  if (jobs.length === 0) return null
  const shown = shared.includes(scenario) ? scenario : ''
  const scenarios = shown === '' ? shared : [shown]
  return (
    <>
      <Card
        title="Outcomes"
        note={
          shared.length === 0
            ? 'The jobs have no scenario in common.'
            : 'Of each job’s best design. The best value of a row is bold; designs that violate a limit do not count.'
        }
        tools={
          <Select
            label="Scenario"
            value={shown}
            options={[
              ['', `mean of ${shared.length} shared`],
              ...shared.map((name) => [name, name] as const),
            ]}
            onChoose={(name) => setQuery({ scenario: name || null })}
          />
        }
      >
        <Table
          caption="Outcomes of the jobs"
          rows={quantitiesOf(jobs)}
          rowData={({ name }) => ({ 'data-quantity': name })}
          columns={[
            {
              key: 'objective',
              header: true,
              value: ({ name }) => name,
              cell: ({ name, unit }) => (
                <>
                  {capitalized(inWords(name))}
                  <Unit unit={unit} />
                </>
              ),
            },
            ...jobs.map((job, k) => ({
              key: job.id,
              heading: <JobName job={job} index={k} />,
              label: job.name || job.id,
              numeric: true,
              cell: (quantity: Quantity) => (
                <Outcome
                  values={jobs.map((each) => outcomeOf(each, quantity, scenarios))}
                  at={k}
                  more={quantity.more}
                />
              ),
            })),
          ]}
        />
      </Card>
      {shared.length > 0 && (
        <Card
          title="Walks"
          note={`Best designs in ${scenarios[0]}, simulated on demand.`}
          tools={
            !running && (
              <button type="button" onClick={() => setRunning(true)}>
                Simulate the walks
              </button>
            )
          }
        >
          {running && (
            <div class="compared-walks">
              {jobs.map(
                (job, k) =>
                  job.best && <Walk key={job.id} job={job} index={k} scenario={scenarios[0]} />,
              )}
            </div>
          )}
        </Card>
      )}
    </>
  )
}

function Walk({ job, index, scenario }: { job: Job; index: number; scenario: string }) {
  const box = useRef<HTMLElement>(null)
  const visible = useVisible(box)
  const { robot, controller, scenarios } = job.spec as JobSpec
  const label = job.name || job.id
  const { design } = job.best!
  return (
    <figure class="walk-preview" ref={box} data-walk={job.id}>
      <WalkStage
        name={`${job.id} ${placeWord(job.best!)} ${scenario}`}
        record={(signal) =>
          recordWalk(
            { label, robot, controller: { name: controller }, design },
            scenarios.find((each) => typeof each !== 'string' && each.name === scenario) ??
              scenario,
            RATE,
            signal,
          )
        }
        label={`Replay of ${label}`}
        visible={visible}
      />
      <figcaption>
        <JobName job={job} index={index} />
      </figcaption>
    </figure>
  )
}

interface OutcomeProps {
  /** Of all jobs; null if unknown. */
  values: readonly (number | null)[]
  at: number
  more: boolean
}

function Outcome({ values, at, more }: OutcomeProps) {
  const value = values[at]
  const best = bestOf(values, more)
  if (value === null || best === null) return <span>{NONE}</span>
  if (value === best) return <b data-best>{formatNumber(value, 3)}</b>
  return (
    <>
      {formatNumber(value, 3)}{' '}
      {best > 0 && <span class="muted small">{change(100 * (value / best - 1), '%', 2)}</span>}
    </>
  )
}

/** The best of some values; null if there are no two to compare. */
export function bestOf(values: readonly (number | null)[], more: boolean): number | null {
  const present = values.filter((value) => value !== null)
  if (present.length === 0) return null
  return more ? Math.max(...present) : Math.min(...present)
}

/** Scenarios of all jobs, by name. */
export function sharedScenarios(jobs: readonly Pick<Job, 'best'>[]): readonly string[] {
  const [first, ...others] = jobs.flatMap(({ best }) => (best ? [best.scenarios] : []))
  return Object.keys(first ?? {}).filter((name) => others.every((each) => name in each))
}

function quantitiesOf(jobs: readonly Job[]): readonly Quantity[] {
  const all = new Map(jobs.flatMap((job) => job.objectives).map(({ name, unit }) => [name, unit]))
  return [...all].map(([name, unit]) => quantityOf({ name, unit }))
}

/** Mean over scenarios; null if the design fails in one of them. */
export function outcomeOf(
  { best }: Pick<Job, 'best'>,
  quantity: Pick<Quantity, 'name'>,
  scenarios: readonly string[],
): number | null {
  const values = scenarios
    .map((scenario) => amountOf(best?.scenarios[scenario], quantity))
    .filter((value) => value !== null)
  if (values.length === 0 || values.length < scenarios.length) return null
  return values.reduce((sum, value) => sum + value, 0) / values.length
}
