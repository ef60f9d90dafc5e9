/** Replay page of one walk, or two compared, with objectives and plots. */

import { useEffect, useMemo, useState } from 'preact/hooks'
import { get } from '../api/client'
import { isPublished, NOT_PUBLISHED } from '../api/jobs'
import { useResource } from '../api/resource'
import type { Scenario, ScenarioPreset } from '../api/types'
import { ErrorNotice, Loading } from '../components/feedback'
import { formatExact } from '../format/number'
import { inWords } from '../format/words'
import { setQuery } from '../router/navigation'
import { useDelayedQuery, useQueryValue } from '../router/query-value'
import { DesignHeading, DesignLinks, DesignPage } from './design/design-page'
import { DesignPicker } from './design/design-picker'
import { type DesignSource, queryOf, sourceOf, sourceOfWord, wordOf } from './design/design-source'
import { type ResolvedDesign, resolveDesign } from './design/resolve-design'
import { Playback } from './player/playback'
import { Player } from './player/player'
import { CAMERA, DEFAULT_VIEW, MOMENT, VIEW } from './player/view-words'
import { DEFAULT_RATE, RATES, type Recorded, recordWalk } from './replay/replay'
import './walk.css'
import { WalkPlots } from './plots/walk-plots'
import { FailureNotices } from './walk-result'

export default function WalkPage() {
  return (
    <DesignPage title="Walk" path="/walk" read={addressOf}>
      {(address, query) => <Walk {...address} query={query} />}
    </DesignPage>
  )
}

interface WalkProps {
  source: DesignSource
  against: DesignSource | null
  query: URLSearchParams
  embedded?: boolean
}

/** embedded: in the page of its job, whose best design is shown. */
export function Walk({ source, against, query, embedded = false }: WalkProps) {
  const rate = RATES.find((candidate) => String(candidate) === query.get('rate')) ?? DEFAULT_RATE
  const presets = useResource('scenarios', (signal) => get('/v1/scenarios', { signal }))
  const first = useResource(wordOf(source), (signal) => resolveDesign(source, signal))
  const like = first.data?.controller.name
  const second = useResource(against && like ? `${wordOf(against)} ${like}` : null, (signal) =>
    resolveDesign(against!, signal, like),
  )
  const jobScenarios = first.data?.scenarios ?? []
  const hasPublished = first.data === null || isPublished(first.data.robot)
  const listed = hasPublished ? (presets.data?.items ?? []) : []
  const requested =
    query.get('scenario') ?? jobScenarios[0]?.name ?? listed[0]?.name ?? 'normal-fast'
  const scenario = jobScenarios.find(({ name }) => name === requested) ?? requested
  const one = useWalk(first.data, scenario, rate)
  const other = useWalk(against ? second.data : null, scenario, rate)
  const failed = [presets, first, second, one, other].find(({ error }) => error !== null)
  const awaited = against !== null && (other.data === null || other.loading)
  const compared = second.data ? [`compared with ${second.data.label}`] : []
  return (
    <div class="stack">
      {!embedded && (
        <DesignHeading
          title="Walk"
          path="/walk"
          design={first.data}
          details={[`scenario ${requested}`, ...compared]}
        />
      )}
      <div class="walk-choice">
        {!embedded && (
          <DesignPicker
            label="Design"
            chosen={first.data?.source ?? source}
            chosenLabel={first.data?.label ?? 'This design'}
            onChoose={(chosen) => setQuery(queryOf(chosen!))}
          />
        )}
        <ScenarioPicker jobScenarios={jobScenarios} presets={listed} chosen={requested} />
        <DesignPicker
          label="Compare with"
          chosen={against}
          chosenLabel={second.data?.label ?? 'This design'}
          none="Nothing"
          note={hasPublished ? undefined : NOT_PUBLISHED}
          onChoose={(chosen) => setQuery({ against: chosen && wordOf(chosen) })}
        />
        <RatePicker rate={rate} />
        <DesignLinks
          source={first.data?.source ?? source}
          path={first.data && '/controller'}
          label="Show controller"
          withJob={!embedded}
        />
      </div>
      {failed?.error && (
        <ErrorNotice what="Could not load the walk." error={failed.error} retry={failed.reload} />
      )}
      {!failed && one.loading && <Loading what="the walk; simulating it" />}
      {!failed && !one.loading && awaited && <Loading what="the walk to compare with" />}
      {one.data && <Recording one={one.data} other={against ? other.data : null} />}
    </div>
  )
}

/** Simulate and record the walk of a design once the design is loaded. */
function useWalk(design: ResolvedDesign | null, scenario: string | Scenario, rate: number) {
  const key = design && JSON.stringify([wordOf(design.source), design.design, scenario, rate])
  return useResource(key, (signal) => recordWalk(design!, scenario, rate, signal))
}

function Recording({ one, other }: { one: Recorded; other: Recorded | null }) {
  const walks = useMemo(() => (other ? [one, other] : [one]), [one, other])
  const shown = useMemo(() => walks.filter(({ replay }) => replay.frames > 0), [walks])
  const [options, onOptions] = useQueryValue('view', VIEW, DEFAULT_VIEW)
  const [camera, setCamera] = useQueryValue('camera', CAMERA, null)
  const [requestedTime] = useQueryValue('t', MOMENT, null)
  const writeTime = useDelayedQuery('t')
  // A time in the address applies to the first walk only.
  const [first] = useState(() => shown)
  const playback = useMemo(() => playbackOf(shown, shown === first ? requestedTime : null), [shown])
  useEffect(
    () => playback.subscribe(() => !playback.playing && writeTime(MOMENT.write(playback.time))),
    [playback],
  )
  return (
    <>
      <FailureNotices walks={walks} />
      {shown.length > 0 && (
        <div class="walk-workspace">
          <Player
            {...{ walks: shown, playback, options, onOptions, camera }}
            onCamera={setCamera}
          />
          <WalkPlots walks={shown} all={walks} playback={playback} />
        </div>
      )}
    </>
  )
}

/** Start at the requested time [s]; otherwise play, unless reduced motion is preferred. */
function playbackOf(walks: readonly Recorded[], moment: number | null): Playback {
  const replays = walks.map(({ replay }) => replay)
  const end = Math.max(0, ...replays.map((replay) => replay.end))
  const playback = new Playback(end, replays[0]?.header.rate ?? DEFAULT_RATE)
  if (moment !== null) playback.seek(moment)
  else if (!matchMedia('(prefers-reduced-motion: reduce)').matches) playback.play()
  return playback
}

function RatePicker({ rate }: { rate: number }) {
  return (
    <div class="field">
      <label for="walk-rate">Recording rate</label>
      <select
        id="walk-rate"
        value={String(rate)}
        onChange={(event) => setQuery({ rate: event.currentTarget.value })}
      >
        {RATES.map((candidate) => (
          <option key={candidate} value={String(candidate)}>
            {candidate} Hz
          </option>
        ))}
      </select>
    </div>
  )
}

/** Throws AddressError. */
function addressOf(query: URLSearchParams) {
  return { source: sourceOf(query), against: sourceOfWord(query.get('against')) }
}

interface ScenarioPickerProps {
  jobScenarios: readonly Scenario[]
  presets: readonly ScenarioPreset[]
  chosen: string
}

function ScenarioPicker({ jobScenarios, presets, chosen }: ScenarioPickerProps) {
  const names = new Set(jobScenarios.map(({ name }) => name))
  const groups = [
    ['Job', jobScenarios],
    [names.size > 0 ? 'Other presets' : 'Presets', presets.filter(({ name }) => !names.has(name))],
  ] as const
  return (
    <div class="field">
      <label for="walk-scenario">Scenario</label>
      <select
        id="walk-scenario"
        value={chosen}
        onChange={(event) => setQuery({ scenario: event.currentTarget.value })}
      >
        {groups
          .filter(([, scenarios]) => scenarios.length > 0)
          .map(([label, scenarios]) => (
            <optgroup key={label} label={label}>
              {scenarios.map((scenario) => (
                <option key={scenario.name} value={scenario.name}>
                  {described(scenario)}
                </option>
              ))}
            </optgroup>
          ))}
      </select>
    </div>
  )
}

function described(scenario: Scenario | ScenarioPreset): string {
  const { name, cycle_time, load, slope, turn, direction, drop, stuck_leg, shove } = scenario
  const parts = [
    `cycle ${formatExact(cycle_time)} s`,
    load && `load ${formatExact(load)} kg`,
    slope && `slope ${formatExact(slope)}°`,
    direction === 'backward' && 'backward',
    drop && `drop ${formatExact(drop * 1e3)} mm`,
    stuck_leg && `${inWords(stuck_leg)} leg stuck`,
    shove && `shove ${formatExact(shove)} N s`,
    turn && `turn ${formatExact(turn)}`,
  ]
  return `${name} (${parts.filter(Boolean).join(', ')})`
}
