/** Scatter chart of the front over two objectives, with marked designs; tables of both. */

import { useMemo } from 'preact/hooks'
import { isPublished } from '../../api/jobs'
import { useResource } from '../../api/resource'
import type { Front, FrontDesign, Job, JobSpec } from '../../api/types'
import { ChartCard, LegendEntry } from '../../charts/chart-card'
import { Scatter } from '../../charts/scatter/scatter'
import { Loaded } from '../../components/card'
import { Check } from '../../components/fields/controls'
import { type Column, Table } from '../../components/table/table'
import { formatCount, NONE } from '../../format/number'
import { type Place, placeWord } from '../../format/place'
import { inWords } from '../../format/words'
import { setQuery, usePlace } from '../../router/navigation'
import { flag, PAGE_NUMBER, useQueryValue } from '../../router/query-value'
import { AxisSelects } from '../axis-select'
import { designColumn, objectiveColumns } from '../columns'
import { type Particles, selectedRows } from '../designs/particles'
import { publishedReferences } from '../reference'
import {
  allCloud,
  axesOf,
  frontCloud,
  marksOf,
  type PublishedDesign,
  publishedDesign,
  publishedMarks,
  selectedCloud,
} from './designs'

interface ScatterCardProps {
  job: Job
  front: Front
  all: Particles | null
  selected: Place | null
  onSelect: (place: Place) => void
}

export function ScatterCard({ job, front, all, selected, onSelect }: ScatterCardProps) {
  const { query } = usePlace()
  const [logarithmic, setLogarithmic] = useQueryValue('log', flag(true), true)
  const paging = useQueryValue('page', PAGE_NUMBER, 0)
  const [x, y] = axesOf(front, query.get('x'), query.get('y'))
  const brush = query.get('brush')
  const brushed = useMemo(() => all && selectedRows(all, brush), [all, brush])
  const clouds = useMemo(() => {
    const behind = all && allCloud(all, x, y)
    const marked = all && brushed && selectedCloud(all, brushed, x, y)
    return [behind, marked, frontCloud(front, x, y)].filter((cloud) => cloud !== null)
  }, [front, all, brushed, x, y])
  // With worlds, an objective is not a mean over scenarios.
  const { worlds, robot } = job.spec as JobSpec
  const comparable = !worlds && isPublished(robot)
  const showPublished = comparable && query.has('published')
  // Those that succeed in all scenarios of the job.
  const published = useResource(showPublished ? `published ${job.id}` : null, async () => {
    const references = await publishedReferences(job)
    return references.map((each) => publishedDesign(front, each)).filter((each) => each !== null)
  })
  const marks = useMemo(
    () => [...marksOf(front, x, y), ...publishedMarks(published.data ?? [], x, y)],
    [front, published.data, x, y],
  )
  const index = front.designs.findIndex(
    (design) => selected !== null && placeWord(design) === placeWord(selected),
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
          <AxisSelects axes={front.objectives} x={x} y={y} onSelect={setQuery} />
          {comparable && (
            <Check
              label="published designs"
              checked={showPublished}
              onChange={(on) => setQuery({ published: on ? '' : null })}
            />
          )}
          {brushed && (
            <button
              type="button"
              class="compact"
              data-selected={brushed.length}
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
          {brushed && (
            <LegendEntry
              colour="--text"
              label={`${formatCount(brushed.length)} selected in Variables`}
              area
            />
          )}
          <LegendEntry
            colour="--series-5"
            label="best under A, B, C and the job’s preference"
            area
          />
          {published.data && <LegendEntry colour="--series-4" label="published designs" area />}
          {front.knees.length > 0 && <LegendEntry colour="--series-2" label="knees" area />}
        </>
      }
      table={() => (
        <>
          <Table<FrontDesign>
            caption="Designs of the front"
            rows={front.designs}
            rowKey={placeWord}
            paging={paging}
            order={{ column: 'property', descending: false }}
            pageSize={20}
            columns={[
              designColumn(job, true),
              {
                key: 'property',
                value: ({ marks }) => marks.join(', ') || null,
                cell: ({ marks }) => marks.map(inWords).join(', ') || NONE,
              },
              ...objectiveColumns(front.objectives),
              { key: 'fitness', digits: 5, value: ({ fitness }) => fitness },
              fitColumn(selected, onSelect),
            ]}
          />
          {published.data && (
            <Table<PublishedDesign>
              caption="Published designs"
              rows={published.data}
              columns={[
                { key: 'design', header: true, value: ({ label }) => label },
                ...objectiveColumns(front.objectives),
              ]}
            />
          )}
        </>
      )}
    >
      <Loaded resource={published} what="the published designs" />
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
        onChoose={(k) => onSelect(front.designs[k])}
      />
    </ChartCard>
  )
}

/** Buttons that fit a preference to the row's design. */
export function fitColumn(selected: Place | null, onSelect: (place: Place) => void): Column<Place> {
  return {
    key: 'preference',
    cell: (design) => (
      <button
        type="button"
        class="compact"
        aria-pressed={selected !== null && placeWord(selected) === placeWord(design)}
        aria-label={`Find the preference that selects design ${placeWord(design)}`}
        onClick={() => onSelect(design)}
      >
        Find
      </button>
    ),
  }
}
