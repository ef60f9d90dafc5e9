/** Typed requests to the REST API. */

import { ApiProblem, problemOf } from './problem'
import type { paths } from './schema'

type Method = 'get' | 'post' | 'put' | 'patch' | 'delete'

export type PathOf<M extends Method> = {
  [P in keyof paths]: paths[P] extends Record<M, { responses: unknown }> ? P : never
}[keyof paths]

type Operation<P extends keyof paths, M extends Method> =
  paths[P] extends Record<M, infer O> ? O : never

type Json<R> = R extends { content: { 'application/json': infer B } } ? B : never

/** Body of a successful response. */
export type Answer<P extends keyof paths, M extends Method> =
  Operation<P, M> extends { responses: infer R } ? Json<R[keyof R & (200 | 201 | 202)]> : never

/** Request body of an operation. */
export type Body<P extends keyof paths, M extends Method> =
  Operation<P, M> extends { requestBody: { content: { 'application/json': infer B } } } ? B : never

type Query<P extends keyof paths, M extends Method> =
  Operation<P, M> extends { parameters: { query?: infer Q } } ? Q : never

type Params<P extends keyof paths, M extends Method> =
  Operation<P, M> extends { parameters: { path: infer V } } ? V : never

interface Options {
  readonly signal?: AbortSignal
}

/** GET a resource; `get('/v1/jobs/{job_id}', { path: { job_id } })`. */
export async function get<P extends PathOf<'get'>>(
  path: P,
  options: Options & { path?: Params<P, 'get'>; query?: Query<P, 'get'> } = {},
): Promise<Answer<P, 'get'>> {
  const response = await send(url(path, options.path, options.query), { signal: options.signal })
  return (await response.json()) as Answer<P, 'get'>
}

export async function post<P extends PathOf<'post'>>(
  path: P,
  options: Options & {
    path?: Params<P, 'post'>
    body?: Body<P, 'post'>
    headers?: Record<string, string>
  } = {},
): Promise<Answer<P, 'post'>> {
  const request = posted(options.body, options.signal, options.headers)
  const response = await send(url(path, options.path), request)
  return (await response.json()) as Answer<P, 'post'>
}

export async function put<P extends PathOf<'put'>>(
  path: P,
  options: Options & { path?: Params<P, 'put'>; body?: Body<P, 'put'> } = {},
): Promise<Answer<P, 'put'>> {
  const request = { ...posted(options.body, options.signal), method: 'PUT' }
  const response = await send(url(path, options.path), request)
  return (await response.json()) as Answer<P, 'put'>
}

export async function patch<P extends PathOf<'patch'>>(
  path: P,
  options: Options & { path?: Params<P, 'patch'>; body: Body<P, 'patch'> },
): Promise<Answer<P, 'patch'>> {
  const request = { ...posted(options.body, options.signal), method: 'PATCH' }
  const response = await send(url(path, options.path), request)
  return (await response.json()) as Answer<P, 'patch'>
}

export async function remove<P extends PathOf<'delete'>>(
  path: P,
  options: Options & { path?: Params<P, 'delete'> } = {},
): Promise<void> {
  await send(url(path, options.path), { method: 'DELETE', signal: options.signal })
}

/** GET a resource that is not JSON. */
export async function getBytes<P extends PathOf<'get'>>(
  path: P,
  options: Options & { path?: Params<P, 'get'>; query?: Query<P, 'get'> } = {},
): Promise<ArrayBuffer> {
  const response = await send(url(path, options.path, options.query), { signal: options.signal })
  return response.arrayBuffer()
}

/** POST a body; the response is not JSON. */
export async function postBytes<P extends PathOf<'post'>>(
  path: P,
  options: Options & { path?: Params<P, 'post'>; body?: Body<P, 'post'> } = {},
): Promise<ArrayBuffer> {
  const response = await send(url(path, options.path), posted(options.body, options.signal))
  return response.arrayBuffer()
}

/** Fill in the path parameters and append the query; null values are left out, lists repeat the name. */
export function url(path: string, params?: unknown, query?: unknown): string {
  const values = (params ?? {}) as Record<string, unknown>
  const filled = path.replace(/\{(\w+)\}/g, (_, name: string) =>
    encodeURIComponent(String(values[name])),
  )
  const pairs = Object.entries(query ?? {}).flatMap(([name, value]) =>
    [value].flat().map((each) => [name, each] as const),
  )
  const set = pairs.filter(([, value]) => value !== undefined && value !== null)
  if (set.length === 0) return filled
  return `${filled}?${new URLSearchParams(set.map(([name, value]) => [name, String(value)]))}`
}

function posted(
  body: unknown,
  signal?: AbortSignal,
  headers: Record<string, string> = {},
): RequestInit {
  if (body === undefined) return { method: 'POST', headers, signal }
  return {
    method: 'POST',
    headers: { ...headers, 'Content-Type': 'application/json' },
    body: JSON.stringify(body),
    signal,
  }
}

/** Throw ApiProblem for any response but a success; AbortError passes through. */
async function send(target: string, init: RequestInit): Promise<Response> {
  let response: Response
  try {
    response = await fetch(target, init)
  } catch (error) {
    if (error instanceof DOMException && error.name === 'AbortError') throw error
    throw new ApiProblem(0, 'cannot reach the server; is `gaitswarm serve` still running?')
  }
  if (!response.ok) {
    // The sign-in form reports a rejected token itself.
    if (response.status === 401 && target !== SESSION)
      for (const listener of unauthorized) listener()
    throw await problemOf(response)
  }
  return response
}

const SESSION = '/v1/session'
const unauthorized = new Set<() => void>()

/** Subscribe to 401 responses; returns the unsubscribe function. */
export function onUnauthorized(listener: () => void): () => void {
  unauthorized.add(listener)
  return () => unauthorized.delete(listener)
}
