/** Scatter chart of the front over two objectives, with marked designs; tables of both. */

import { useMemo } from 'preact/hooks'
import { useResource } from '../../api/resource'
import { isPublished } from '../../api/robots'
import type { Front, Job, JobSpec } from '../../api/types'
import { ChartCard, LegendEntry } from '../../charts/chart-card'
import { Scatter } from '../../charts/scatter/scatter'
import { ErrorNotice } from '../../components/feedback'
import { Check } from '../../components/fields/controls'
import { formatCount } from '../../format/number'
import { type Place, placeWord } from '../../format/place'
import { capitalized, inWords } from '../../format/words'
import { setQuery, usePlace } from '../../router/navigation'
import { flag, useQueryValue } from '../../router/query-value'
import type { Particles } from '../designs/particles'
import { selectedRows } from '../designs/selection'
import { publishedWalks } from '../reference'
import {
  allCloud,
  axesOf,
  frontCloud,
  marksOf,
  publishedDesign,
  publishedMarks,
  selectedCloud,
} from './designs'
import { FrontTable, PublishedTable } from './front-table'

export function ScatterCard({
  job,
  front,
  all,
  chosen,
  onChoose,
}: {
  job: Job
  front: Front
  /** Designs drawn behind the front; null while loading. */
  all: Particles | null
  chosen: Place | null
  onChoose: (place: Place) => void
}) {
  const { query } = usePlace()
  const [logarithmic, setLogarithmic] = useQueryValue('log', flag(true), true)
  const [x, y] = axesOf(front, query.get('x'), query.get('y'))
  const brush = query.get('brush')
  const selected = useMemo(() => all && selectedRows(all, brush), [all, brush])
  const clouds = useMemo(() => {
    const behind = all && allCloud(all, x, y)
    const marked = all && selected && selectedCloud(all, selected, x, y)
    return [behind, marked, frontCloud(front, x, y)].filter((cloud) => cloud !== null)
  }, [front, all, selected, x, y])
  // With worlds, an objective is not a mean over scenarios.
  const { worlds, robot } = job.spec as JobSpec
  const comparable = !worlds && isPublished(robot)
  const showPublished = comparable && query.has('published')
  const published = usePublished(job, front, showPublished)
  const marks = useMemo(
    () => [...marksOf(front, x, y), ...publishedMarks(published.data ?? [], x, y)],
    [front, published.data, x, y],
  )
  const index = front.designs.findIndex(
    (design) => chosen !== null && placeWord(design) === placeWord(chosen),
  )
  const unit = (name: string) => front.objectives.find((o) => o.name === name)!.unit
  const listed =
    front.designs.length < front.size
      ? ` An evenly spaced subset of ${formatCount(front.designs.length)} is shown.`
      : ''
  return (
    <ChartCard
      title="Pareto front"
      note={`Each objective is its geometric mean over the scenarios; lower is better.${listed} Click a design to find the preference that selects it.`}
      tools={
        <>
          <AxisPicker
            label="across"
            front={front}
            chosen={x}
            other={y}
            onChoose={(name) => setQuery({ x: name, y })}
          />
          <AxisPicker
            label="up"
            front={front}
            chosen={y}
            other={x}
            onChoose={(name) => setQuery({ x, y: name })}
          />
          {comparable && (
            <label class="check small">
              <input
                type="checkbox"
                checked={showPublished}
                onChange={() => setQuery({ published: showPublished ? null : '' })}
              />
              published designs
            </label>
          )}
          {selected && (
            <button
              type="button"
              class="compact"
              data-selected={selected.length}
              onClick={() => setQuery({ brush: null })}
            >
              Select all
            </button>
          )}
          <Check label="logarithmic" checked={logarithmic} onChange={setLogarithmic} />
        </>
      }
      legend={
        <>
          <LegendEntry colour="--series-1" label="front" area />
          <LegendEntry colour="--series-6" label="other designs" area />
          {selected && (
            <LegendEntry
              colour="--text"
              label={`${formatCount(selected.length)} selected in Variables`}
              area
            />
          )}
          <LegendEntry
            colour="--series-5"
            label="best under A, B, C and the job’s preference"
            area
          />
          {published.data && <LegendEntry colour="--series-4" label="published designs" area />}
          {published.loading && <span role="status">simulating published designs…</span>}
          {front.knees.length > 0 && <LegendEntry colour="--series-2" label="knees" area />}
        </>
      }
      table={() => (
        <>
          <FrontTable job={job} front={front} chosen={chosen} onChoose={onChoose} />
          {published.data && <PublishedTable front={front} designs={published.data} />}
        </>
      )}
    >
      {published.error && (
        <ErrorNotice
          what="Could not load the published designs."
          error={published.error}
          retry={published.reload}
        />
      )}
      <Scatter
        label={`${formatCount(front.designs.length)} designs of the front by ${inWords(x)} and ${inWords(y)}`}
        xLabel={inWords(x)}
        xUnit={unit(x)}
        yLabel={inWords(y)}
        yUnit={unit(y)}
        clouds={clouds}
        marks={marks}
        logarithmic={logarithmic}
        chosen={index < 0 ? null : index}
        onChoose={(k) => onChoose(front.designs[k])}
      />
    </ChartCard>
  )
}

/** Published designs that succeed in all scenarios of the job; simulated on demand. */
function usePublished(job: Job, front: Front, showPublished: boolean) {
  return useResource(showPublished ? `published ${job.id}` : null, async () => {
    const walks = await publishedWalks(job)
    return walks.map((walk) => publishedDesign(front, walk)).filter((design) => design !== null)
  })
}

function AxisPicker({
  label,
  front,
  chosen,
  other,
  onChoose,
}: {
  label: string
  front: Front
  chosen: string
  /** Objective of the other axis. */
  other: string
  onChoose: (name: string) => void
}) {
  return (
    <label class="row small">
      <span>{capitalized(label)}</span>
      <select value={chosen} onChange={(event) => onChoose(event.currentTarget.value)}>
        {front.objectives.map(({ name }) => (
          <option key={name} value={name} disabled={name === other}>
            {inWords(name)}
          </option>
        ))}
      </select>
    </label>
  )
}
